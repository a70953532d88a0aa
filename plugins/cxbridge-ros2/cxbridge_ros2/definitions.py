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
from cxbridge_ros2.builtin_definitions import BUILT_IN_DEFINITIONS
from cxbridge_ros2.names import TypeName, parse_type

# The type of a field in rosbags: a Nodetype, and its details. BASE has the name of the base type and the
# maximum length of a string (0: no limit), NAME the name of the message, ARRAY and SEQUENCE the type of the
# elements and the (maximum) number of elements.
FieldType = tuple[Any, ...]

Fields = list[tuple[str, FieldType]]

# The supported ROS distributions. rosbags contains their types, and those of older distributions.
DISTRIBUTIONS: Final = ("humble", "iron", "jazzy", "kilted", "lyrical")

DEFAULT_DISTRIBUTION: Final = "jazzy"

_TIME_TYPE: Final = parse_type("builtin_interfaces/msg/Time")
_UUID_TYPE: Final = parse_type("unique_identifier_msgs/msg/UUID")
_EVENT_INFO_TYPE: Final = parse_type("service_msgs/msg/ServiceEventInfo")
_SEPARATOR: Final = re.compile(r"^[ \t]*---[ \t]*$", re.MULTILINE)

# The number of sections by the kind of definition, which is also the name of a folder in a package.
_SECTION_COUNTS: Final = {"msg": 1, "srv": 2, "action": 3}

# A field with a default value: `float64 w 1.0`. A constant has = after the name.
_DEFAULT_PATTERN: Final = re.compile(r"[a-zA-Z][^\s#]*[ \t]+([a-zA-Z]\w*)[ \t]+([^\s=#].*)")

# The default values of well-known types, which rosbags leaves out.
_WELL_KNOWN_DEFAULTS: Final[dict[str, dict[str, Any]]] = {
    "geometry_msgs/msg/Quaternion": {"w": 1.0},
}


class Definitions:
    """The definitions of types, which a request for a type loads into a store.

    :param folders: packages, or folders with packages.
    :param distribution: the distribution of the well-known types.
    :param environment: the environment variables, of which ``AMENT_PREFIX_PATH`` is read; by default those of
        the process.
    :param texts: more definitions by type, with less priority than files and well-known types.
    :ivar store: the type store of rosbags, whose ``fielddefs`` has the constants and the fields of each
        loaded message.
    :ivar has_type_hashes: whether types have hashes and services have events, as since ROS 2 Iron.
    :raises Ros2Error: if a folder or the distribution does not exist.
    """

    def __init__(
        self,
        folders: Iterable[Path | str] = (),
        distribution: str = DEFAULT_DISTRIBUTION,
        environment: Mapping[str, str] | None = None,
        texts: Mapping[str, str] | None = None,
    ) -> None:
        self._definition_texts = {**BUILT_IN_DEFINITIONS, **(texts or {})}
        store = Stores.__members__.get(f"ROS2_{distribution.upper()}")
        if store is None:
            raise Ros2Error(
                f"unknown ROS distribution '{distribution}'", hint=did_you_mean(distribution, DISTRIBUTIONS)
            )
        self.store: Any = get_typestore(store)
        for name, (constants, fields) in self.store.fielddefs.items():
            self.store.fielddefs[name] = (constants, _replace_char_fields(fields))
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
            self.store.fielddefs.pop(name, None)
            self.store.types.pop(name, None)
        self._loaded_names: set[str] = set()
        self.has_type_hashes = str(_EVENT_INFO_TYPE) in {*self.store.fielddefs, *self._definition_files}
        self._defaults = dict(_WELL_KNOWN_DEFAULTS)

    # --- known types --------------------------------------------------------------------------------------

    def find_names(self) -> list[str]:
        """Return the sorted names of all messages, services and actions that can be loaded."""
        store_names = (str(parse_type(name).definition) for name in self.store.fielddefs)
        return sorted({*store_names, *self._definition_files, *self._definition_texts})

    def find_fields(self, name: TypeName) -> Sequence[tuple[str, FieldType]]:
        """Return the fields of a message in order.

        :raises Ros2Error: if the type is unknown, or its file is broken.
        """
        self._load(name)
        fields: Fields = self.store.fielddefs[str(name)][1]
        return fields

    def check_path(self, name: TypeName, path: str) -> None:
        """Check that a message has the field at a dotted path.

        :raises Ros2Error: if a message on the path lacks a field, a field before the last is not a message, a
            type is unknown, or its file is broken.
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
        """Return the default values in the definition of a loaded message, by field.

        A field without a default value is zero, false or empty.
        """
        return self._defaults.get(str(name), {})

    def compute_type_hash(self, name: TypeName) -> str:
        """Return the hash of a type: ``RIHS01_`` and 64 hexadecimal digits.

        :param name: a message, a service, an action, or a message derived from these.
        :raises Ros2Error: if the type is unknown, or its file is broken.
        """
        self._load(name)
        return str(self.store.hash_rihs01(str(name)))

    def add_definition(self, name: str, text: str) -> None:
        """Add the text of a definition and of its nested types, as in recordings; known types stay unchanged.

        :raises Ros2Error: if the text is not a definition.
        """
        if name in self.store.fielddefs:
            return
        new_types: dict[str, tuple[list[Any], Fields]] = {
            message_name: ([], fields)
            for message_name, fields in _parse_messages(text, name).items()
            if message_name not in self.store.fielddefs
        }
        self.store.register(new_types)
        self._loaded_names.update(new_types)

    # --- loading ------------------------------------------------------------------------------------------

    def _load(self, name: TypeName) -> None:
        """Load a type and its nested types into the store."""
        # loading a service or an action loads all its messages
        if not self._loaded_names.isdisjoint((str(name), str(name.definition))):
            return
        if str(name) in self.store.fielddefs:  # a well-known type
            self._loaded_names.add(str(name))
            self._load_nested(self.store.fielddefs[str(name)][1])
        else:
            self._register(name.definition)
        if str(name) not in self.store.fielddefs:
            raise self._make_unknown_type_error(name)

    def _register(self, name: TypeName) -> None:
        """Register a definition in the store, with the messages derived from it."""
        messages = dict(self._derive_messages(name))
        # marked before the nested types are loaded, since a broken type may contain itself
        self._loaded_names.add(str(name))
        try:
            self.store.register({message: ([], fields) for message, fields in messages.items()})
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
        file, sections = self._definition_files.get(str(name)), self._read_sections(name)
        suffixes = {"msg": (), "srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}
        section_names = [name.derive(suffix) for suffix in suffixes[name.kind]] or [name]
        self._defaults.update(zip(map(str, section_names), map(_parse_defaults, sections), strict=True))
        section_fields = [_parse_section(section, name, file) for section in sections]
        if name.kind == "msg":
            yield str(name), section_fields[0]
        elif name.kind == "srv":
            yield from _make_service_messages(name, *section_fields, has_event=self.has_type_hashes)
        else:
            yield from _make_action_messages(name, section_fields, has_events=self.has_type_hashes)

    def _read_sections(self, name: TypeName) -> list[str]:
        """Return the text of each section of a definition."""
        file = self._definition_files.get(str(name))
        if file is None and str(name) not in self._definition_texts:
            raise self._make_unknown_type_error(name)
        try:
            text = self._definition_texts[str(name)] if file is None else file.read_text("utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise Ros2Error(f"cannot read the definition of {name}: {error}", file=file) from None
        sections = _SEPARATOR.split(text)
        if len(sections) != _SECTION_COUNTS[name.kind]:
            raise Ros2Error(
                f"{name} must have {_SECTION_COUNTS[name.kind]} sections, not {len(sections)}",
                file=file,
                hint="separate the sections by lines with ---",
            )
        return sections

    def _make_unknown_type_error(self, name: TypeName) -> Ros2Error:
        return Ros2Error(
            f"unknown ROS 2 type {name}",
            hint=did_you_mean(str(name), self.find_names(), "name the folder of its package"),
        )


# --- files --------------------------------------------------------------------------------------------------


def _find_definition_files(folder: Path) -> dict[str, Path]:
    """Return the definition files of all packages in a folder, by type.

    :raises Ros2Error: if the folder does not exist.
    """
    if not folder.is_dir():
        raise Ros2Error("there is no such folder with ROS packages", file=folder)
    definition_files: dict[str, Path] = {}
    for directory in sorted(Path(directory) for directory, _, _ in walk_folders(folder)):
        kind = directory.name
        if kind in _SECTION_COUNTS:
            package = _read_package_name(directory.parent)
            files = sorted(directory.glob(f"*.{kind}"))
            definition_files.update({f"{package}/{kind}/{file.stem}": file for file in files})
    return definition_files


def _read_package_name(folder: Path) -> str:
    """Return the name of a package from its package.xml, or from its folder without a package.xml."""
    try:
        name = ET.parse(folder / "package.xml").getroot().findtext("name")  # noqa: S314 - the user's own file
    except (OSError, ET.ParseError):
        name = None
    return (name or folder.name).strip()


def _parse_section(text: str, name: TypeName, file: Path | None) -> Fields:
    # rosbags parses the section as a message of the package, which completes the names of nested types
    message_name = f"{name.package}/msg/{name.name}"
    try:
        fields = _parse_messages(text, message_name)[message_name]
    except Ros2Error as error:
        raise Ros2Error(f"{name}: {error.message}", file=file) from None
    # rosbags takes wstring for the name of a message in this package
    wide_types = (f"{name.package}/msg/wstring", f"{name.package}/msg/wchar")
    for field, field_type in fields:
        if _find_nested_type(field_type) in wide_types:
            raise Ros2Error(
                f"{name}: the field '{field}' is a wide string, which is not supported", file=file
            )
    return fields


def _parse_messages(text: str, name: str) -> dict[str, Fields]:
    """Return the fields of a message and of the nested messages in its text, by name.

    :raises Ros2Error: if the text is not a definition.
    """
    try:
        definitions = get_types_from_msg(text, name)
    except (TypesysError, ValueError) as error:
        raise Ros2Error(" ".join(str(error).split())) from None
    return {message_name: _replace_char_fields(fields) for message_name, (_, fields) in definitions.items()}


def _parse_defaults(text: str) -> dict[str, Any]:
    """Return the default values in a section by field, since rosbags ignores default values."""
    matches = (_DEFAULT_PATTERN.match(line.strip()) for line in text.splitlines())
    return {match[1]: yaml.safe_load(match[2]) for match in matches if match}


# --- messages derived from services and actions -------------------------------------------------------------


def _make_service_messages(
    name: TypeName, request: Fields, response: Fields, *, has_event: bool
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
    name: TypeName, sections: list[Fields], *, has_events: bool
) -> Iterator[tuple[str, Fields]]:
    """Yield the messages of an action: goal, result, feedback, and those of its services and its topic."""
    goal, result, feedback = (name.derive(suffix) for suffix in ("Goal", "Result", "Feedback"))
    for section_name, fields in zip((goal, result, feedback), sections, strict=True):
        yield str(section_name), fields
    send_goal, get_result, feedback_message = (
        name.derive(suffix) for suffix in ("SendGoal", "GetResult", "FeedbackMessage")
    )
    goal_id = ("goal_id", _make_named_type(_UUID_TYPE))
    acceptance: Fields = [("accepted", _make_base_type("bool")), ("stamp", _make_named_type(_TIME_TYPE))]
    status_and_result: Fields = [("status", _make_base_type("int8")), ("result", _make_named_type(result))]
    goal_request: Fields = [goal_id, ("goal", _make_named_type(goal))]
    yield from _make_service_messages(send_goal, goal_request, acceptance, has_event=has_events)
    yield from _make_service_messages(get_result, [goal_id], status_and_result, has_event=has_events)
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
    match field_type:
        case (Nodetype.ARRAY | Nodetype.SEQUENCE as kind, (element_type, length)):
            return kind, (_replace_char_type(element_type), length)
        case (Nodetype.BASE, ("char", _)):
            return _make_base_type("uint8")
    return field_type


def _find_nested_type(field_type: FieldType) -> str | None:
    """Return the name of the message in a field or in its elements; None for base types."""
    match field_type:
        case (Nodetype.ARRAY | Nodetype.SEQUENCE, (element_type, _)):
            return _find_nested_type(element_type)
        case (Nodetype.NAME, name):
            return str(name)
    return None
