"""Definitions of messages, services and actions, from .msg, .srv and .action files.

The sources in the order of priority are the user's folders, a sourced ROS environment
(``AMENT_PREFIX_PATH``), the well-known types of a ROS distribution from rosbags, and texts in the program.
A file is read when one of its types is requested.

rosbags parses messages, reads and writes CDR, and computes type hashes (REP 2016). Since rosbags supports
neither services nor actions, this module derives their messages: a service has a request and a response, an
action has a goal, a result, feedback, and the messages of its two services and its topic.
"""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree as ET

import yaml
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.base import TypesysError

from cxbridge.errors import Ros2Error
from cxbridge.file_access import walk_folders
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.builtin import BUILT_IN_DEFINITIONS
from cxbridge_ros2.names import DEFINITION_KINDS, TypeName, parse_type

# The type of a field in rosbags: a Nodetype, and its details. BASE has the name of the base type and the
# maximum length of a string (0: no limit), NAME the name of the message, ARRAY and SEQUENCE the type of the
# elements and the (maximum) number of elements.
FieldType = tuple[Any, ...]

Fields = list[tuple[str, FieldType]]

# ROS distributions whose types rosbags contains.
DISTRIBUTIONS: Final = ("humble", "iron", "jazzy", "kilted", "lyrical")

DEFAULT_DISTRIBUTION: Final = "jazzy"

_TIME_TYPE: Final = parse_type("builtin_interfaces/msg/Time")
_UUID_TYPE: Final = parse_type("unique_identifier_msgs/msg/UUID")
_EVENT_INFO_TYPE: Final = parse_type("service_msgs/msg/ServiceEventInfo")
_SEPARATOR: Final = "---"
_SECTION_COUNTS: Final = {"msg": 1, "srv": 2, "action": 3}

# A field with a default value: `float64 w 1.0`.
_DEFAULT_PATTERN: Final = re.compile(r"[a-zA-Z][^\s#]*[ \t]+([a-zA-Z]\w*)[ \t]+([^\s=#].*)")

# The default values of well-known types, which rosbags leaves out.
_WELL_KNOWN_DEFAULTS: Final[dict[str, dict[str, Any]]] = {
    "geometry_msgs/msg/Quaternion": {"w": 1.0},
    "type_description_interfaces/srv/GetTypeDescription_Request": {"include_type_sources": True},
}


class Definitions:
    """The known types.

    :param folders: packages, or folders with packages.
    :param distribution: the distribution of the well-known types; None for no well-known types.
    :param environment: the environment with ``AMENT_PREFIX_PATH``; by default that of the process.
    :param texts: further definitions by type, with less priority than files.
    :ivar has_type_hashes: whether types have hashes and services have events, as since ROS 2 Iron.
    :raises Ros2Error: if a folder or the distribution does not exist.
    """

    def __init__(
        self,
        folders: Iterable[Path | str] = (),
        distribution: str | None = DEFAULT_DISTRIBUTION,
        environment: Mapping[str, str] | None = None,
        texts: Mapping[str, str] | None = None,
    ) -> None:
        self._definition_texts = {**BUILT_IN_DEFINITIONS, **(texts or {})}
        self._store: Any = get_typestore(_find_store(distribution))
        for name, (constants, fields) in self._store.fielddefs.items():
            self._store.fielddefs[name] = (constants, _replace_char_fields(fields))
        self._definition_files: dict[str, Path] = {}
        prefixes = (os.environ if environment is None else environment).get("AMENT_PREFIX_PATH", "")
        sourced_folders = [Path(prefix) / "share" for prefix in prefixes.split(os.pathsep) if prefix]
        # reversed, since the files of a later folder replace those of an earlier folder
        for folder in (
            *reversed([folder for folder in sourced_folders if folder.is_dir()]),
            *reversed([Path(folder) for folder in folders]),
        ):
            self._definition_files.update(_find_definition_files(folder))
        for name in self._definition_files:  # files override well-known types, which may differ
            self._store.fielddefs.pop(name, None)
            self._store.types.pop(name, None)
        self._loaded_names: set[str] = set()
        self.has_type_hashes = str(_EVENT_INFO_TYPE) in {*self._store.fielddefs, *self._definition_files}
        self._defaults = dict(_WELL_KNOWN_DEFAULTS)

    # --- known types --------------------------------------------------------------------------------------

    def find_names(self) -> list[str]:
        """Return the names of all known types and of all types with a definition."""
        well_known = (
            name for name in self._store.fielddefs if str(_find_definition_name(parse_type(name))) == name
        )
        return sorted({*well_known, *self._definition_files, *self._definition_texts})

    def find_fields(self, name: TypeName) -> Sequence[tuple[str, FieldType]]:
        """Return the fields of a message in order.

        :raises Ros2Error: if the type is unknown, or its file is broken.
        """
        self._load(name)
        fields: Fields = self._store.fielddefs[str(name)][1]
        return fields

    def check_path(self, name: TypeName, path: str) -> None:
        """Check that a message has the field at a dotted path.

        :raises Ros2Error: if the message lacks a field, its type is unknown, or its file is broken.
        """
        field, _, inner_path = path.partition(".")
        fields = dict(self.find_fields(name))
        if field not in fields:
            raise Ros2Error(
                f"{name} has no field '{field}'",
                hint=did_you_mean(field, fields, f"it has: {', '.join(fields)}"),
            )
        kind, details = fields[field]
        if inner_path and kind != Nodetype.NAME:
            raise Ros2Error(f"the field '{field}' of {name} is not a message: '{path}'")
        if inner_path:
            self.check_path(parse_type(details), inner_path)

    def find_defaults(self, name: TypeName) -> Mapping[str, Any]:
        """Return the default values other than zero, by field."""
        return self._defaults.get(str(name), {})

    def compute_type_hash(self, name: TypeName) -> str:
        """Return the hash of a type: ``RIHS01_`` and 64 hexadecimal digits.

        :param name: a message, a service, an action, or a message derived from these.
        """
        self._load(name)
        return str(self._store.hash_rihs01(str(name)))

    @property
    def store(self) -> Any:
        """The type store of rosbags."""
        return self._store

    def add_definition(self, name: str, text: str) -> None:
        """Add the text of a definition and of its nested types, as in recordings; known types stay unchanged.

        :raises Ros2Error: if the text is not a definition.
        """
        if name in self._store.fielddefs:
            return
        try:
            definitions = get_types_from_msg(text, name)
        except (TypesysError, ValueError) as error:
            raise Ros2Error(f"{name}: {' '.join(str(error).split())}") from None
        new_types: dict[str, tuple[list[Any], Fields]] = {
            nested_name: ([], _replace_char_fields(fields))
            for nested_name, (_, fields) in definitions.items()
            if nested_name not in self._store.fielddefs
        }
        self._store.register(new_types)
        self._loaded_names.update(new_types)

    # --- loading ------------------------------------------------------------------------------------------

    def _load(self, name: TypeName) -> None:
        """Load a type and its nested types into the store."""
        definition = _find_definition_name(name)
        # loading a service or an action loads all its messages
        if not self._loaded_names.isdisjoint((str(name), str(definition))):
            return
        if (
            name.kind == "msg"
            and str(name) not in self._definition_files
            and str(name) in self._store.fielddefs
        ):
            self._loaded_names.add(str(name))
            self._load_nested(self._store.fielddefs[str(name)][1])
        else:
            self._register(definition)
        if str(name) not in self._store.fielddefs:
            raise self._make_unknown_type_error(name)

    def _register(self, name: TypeName) -> None:
        """Register a definition in the store, with the messages derived from it."""
        messages = dict(self._derive_messages(name))
        # marked before the nested types are loaded, since a broken type may contain itself
        self._loaded_names.add(str(name))
        try:
            self._store.register({message: ([], fields) for message, fields in messages.items()})
        except TypesysError as error:
            raise Ros2Error(f"{name}: {error}", file=self._definition_files.get(str(name))) from None
        for fields in messages.values():
            self._load_nested(fields, messages)

    def _load_nested(self, fields: Fields, registered_messages: Collection[str] = ()) -> None:
        """Load the nested types of fields, except registered messages of the same definition."""
        for _, field_type in fields:
            nested_name = _find_nested_type(field_type)
            if nested_name is not None and nested_name not in registered_messages:
                self._load(parse_type(nested_name))

    def _derive_messages(self, name: TypeName) -> Iterator[tuple[str, Fields]]:
        """Yield the messages of a definition with their fields, and store their default values."""
        sections, defaults = self._read_sections(name)
        suffixes = {"msg": (), "srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}
        section_names = [name.derive(suffix) for suffix in suffixes[name.kind]] or [name]
        self._defaults.update(zip(map(str, section_names), defaults, strict=True))
        if name.kind == "msg":
            yield str(name), sections[0]
        elif name.kind == "srv":
            yield from _make_service_messages(name, sections[0], sections[1], self.has_type_hashes)
        else:
            yield from _make_action_messages(name, sections, self.has_type_hashes)

    def _read_sections(self, name: TypeName) -> tuple[list[Fields], list[dict[str, Any]]]:
        """Return the fields and the defaults of each section of a definition."""
        file = self._definition_files.get(str(name))
        if file is None and str(name) not in self._definition_texts:
            raise self._make_unknown_type_error(name)
        try:
            text = self._definition_texts[str(name)] if file is None else file.read_text("utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise Ros2Error(f"cannot read the definition of {name}: {error}", file=file) from None
        sections = _split_sections(text)
        if len(sections) != _SECTION_COUNTS[name.kind]:
            raise Ros2Error(
                f"{name} must have {_SECTION_COUNTS[name.kind]} sections, not {len(sections)}",
                file=file,
                hint=f"separate the sections by lines with {_SEPARATOR}",
            )
        fields = [_parse_section(section, name, file, line) for line, section in sections]
        return fields, [_parse_defaults(section) for _, section in sections]

    def _make_unknown_type_error(self, name: TypeName) -> Ros2Error:
        return Ros2Error(
            f"unknown ROS 2 type {name}",
            hint=did_you_mean(str(name), self.find_names(), "name the folder of its package"),
        )


def _find_store(distribution: str | None) -> Stores:
    if distribution is None:
        return Stores.EMPTY
    try:
        return Stores[f"ROS2_{distribution.upper()}"]
    except KeyError:
        raise Ros2Error(
            f"unknown ROS distribution '{distribution}'",
            hint=did_you_mean(distribution, DISTRIBUTIONS),
        ) from None


# --- files --------------------------------------------------------------------------------------------------


def _find_definition_files(folder: Path) -> dict[str, Path]:
    """Return the definition files of all packages in a folder, by type."""
    if not folder.is_dir():
        raise Ros2Error("there is no such folder with ROS packages", file=folder)
    definition_files: dict[str, Path] = {}
    for directory_name, folders, files in walk_folders(folder):
        folders.sort()  # in place, since the walk visits the folders in the order of this list
        directory = Path(directory_name)
        if directory.name not in DEFINITION_KINDS:
            continue
        package = _read_package_name(directory.parent)
        for file in sorted(files):
            path = directory / file
            if path.suffix == f".{directory.name}":
                definition_files[f"{package}/{directory.name}/{path.stem}"] = path
    return definition_files


def _read_package_name(folder: Path) -> str:
    """Return the name of a package from its package.xml, or from its folder without a package.xml."""
    try:
        name = ET.parse(folder / "package.xml").getroot().findtext("name")  # noqa: S314 - the user's own file
    except (OSError, ET.ParseError):
        name = None
    return (name or folder.name).strip()


def _split_sections(text: str) -> list[tuple[int, str]]:
    """Return the first line number and the text of each section of a definition."""
    sections: list[tuple[int, list[str]]] = [(1, [])]
    for number, line in enumerate(text.splitlines(), start=1):
        if line.strip() == _SEPARATOR:
            sections.append((number + 1, []))
        else:
            sections[-1][1].append(line)
    return [(line, "\n".join(lines)) for line, lines in sections]


def _parse_section(text: str, name: TypeName, file: Path | None, line: int) -> Fields:
    # rosbags parses the section as a message of the package, which completes the names of nested types
    message_name = f"{name.package}/msg/{name.name}"
    try:
        ((_, fields),) = get_types_from_msg(text, message_name).values()
    except (TypesysError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise Ros2Error(f"{name}: {reason}", file=file, line=line if file else None) from None
    # rosbags takes wstring for the name of a message in this package
    wide_types = (f"{name.package}/msg/wstring", f"{name.package}/msg/wchar")
    for field, field_type in fields:
        if _find_nested_type(field_type) in wide_types:
            raise Ros2Error(
                f"{name}: the field '{field}' is a wide string, which is not supported", file=file
            )
    return _replace_char_fields(fields)


def _parse_defaults(text: str) -> dict[str, Any]:
    """Return the default values in a section by field; rosbags ignores them."""
    matches = (_DEFAULT_PATTERN.match(line.strip()) for line in text.splitlines())
    return {match[1]: yaml.safe_load(match[2]) for match in matches if match}


# --- messages derived from services and actions -------------------------------------------------------------


def _make_service_messages(
    name: TypeName, request: Fields, response: Fields, has_event: bool
) -> Iterator[tuple[str, Fields]]:
    """Yield the messages of a service: request, response, event, and a message of all three for the hash."""
    yield str(name.derive("Request")), request
    yield str(name.derive("Response")), response
    if not has_event:
        return
    yield (
        str(name.derive("Event")),
        [
            ("info", _make_named_type(_EVENT_INFO_TYPE)),
            # sequences of at most one element
            ("request", (Nodetype.SEQUENCE, (_make_named_type(name.derive("Request")), 1))),
            ("response", (Nodetype.SEQUENCE, (_make_named_type(name.derive("Response")), 1))),
        ],
    )
    suffixes = ("Request", "Response", "Event")
    yield (
        str(name),
        [(f"{suffix.lower()}_message", _make_named_type(name.derive(suffix))) for suffix in suffixes],
    )


def _make_action_messages(
    name: TypeName, sections: list[Fields], has_events: bool
) -> Iterator[tuple[str, Fields]]:
    """Yield the messages of an action: goal, result, feedback, and those of its services and topics."""
    goal, result, feedback = (name.derive(suffix) for suffix in ("Goal", "Result", "Feedback"))
    for section_name, fields in zip((goal, result, feedback), sections, strict=True):
        yield str(section_name), fields
    send_goal, get_result, feedback_message = (
        name.derive(suffix) for suffix in ("SendGoal", "GetResult", "FeedbackMessage")
    )
    goal_id = ("goal_id", _make_named_type(_UUID_TYPE))
    acceptance: Fields = [("accepted", _make_base_type("bool")), ("stamp", _make_named_type(_TIME_TYPE))]
    status_and_result: Fields = [("status", _make_base_type("int8")), ("result", _make_named_type(result))]
    yield from _make_service_messages(
        send_goal, [goal_id, ("goal", _make_named_type(goal))], acceptance, has_events
    )
    yield from _make_service_messages(get_result, [goal_id], status_and_result, has_events)
    yield str(feedback_message), [goal_id, ("feedback", _make_named_type(feedback))]
    if not has_events:
        return
    # a message that stands for the action: peers compare the hash of this type
    members = {
        "goal": goal,
        "result": result,
        "feedback": feedback,
        "send_goal_service": send_goal,
        "get_result_service": get_result,
        "feedback_message": feedback_message,
    }
    yield str(name), [(field, _make_named_type(member)) for field, member in members.items()]


def _make_base_type(name: str) -> FieldType:
    return Nodetype.BASE, (name, 0)


def _make_named_type(name: TypeName) -> FieldType:
    return Nodetype.NAME, str(name)


def _replace_char_fields(fields: Fields) -> Fields:
    """Return fields with ``uint8`` in place of ``char``, as IDL and type hashes have."""
    return [(field, _replace_char_type(field_type)) for field, field_type in fields]


def _replace_char_type(field_type: FieldType) -> FieldType:
    kind, details = field_type
    if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        return kind, (_replace_char_type(details[0]), details[1])
    return _make_base_type("uint8") if kind == Nodetype.BASE and details[0] == "char" else field_type


def _find_nested_type(field_type: FieldType) -> str | None:
    """Return the name of the message in a field or in its elements; None for base types."""
    kind, details = field_type
    if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        return _find_nested_type(details[0])
    return str(details) if kind == Nodetype.NAME else None


# The longest suffixes first: SendGoal_Request ends with Request, too.
_DERIVED_SUFFIXES: Final = (
    *("SendGoal_Request", "SendGoal_Response", "SendGoal_Event", "GetResult_Request", "GetResult_Response"),
    *("GetResult_Event", "SendGoal", "GetResult", "FeedbackMessage", "Goal", "Result", "Feedback"),
    *("Request", "Response", "Event"),
)


def _find_definition_name(name: TypeName) -> TypeName:
    """Return the message, service or action whose definition contains a type."""
    if name.kind != "msg":
        for suffix in _DERIVED_SUFFIXES:
            if name.name.endswith(f"_{suffix}"):
                return TypeName(name.package, name.kind, name.name.removesuffix(f"_{suffix}"))
    return name
