"""Definitions of messages, services and actions, from .msg, .srv, .action and .idl files.

Sources in order: the user's folders, a sourced ROS environment (``AMENT_PREFIX_PATH``), and the well-known
types of a ROS distribution from rosbags. A file is read when one of its types is requested.

rosbags parses messages, reads and writes CDR, and computes type hashes (REP 2016). It does not support
services and actions; this module derives their messages.
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
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.base import TypesysError

from cxbridge.errors import Ros2Error
from cxbridge.file_access import walk
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.builtin import BUILT_IN
from cxbridge_ros2.names import KINDS, TypeName, parse_type

FieldType = tuple[Any, ...]  # a field's type in rosbags: a kind of node and its details

Fields = list[tuple[str, FieldType]]

# ROS distributions with well-known types in rosbags.
DISTRIBUTIONS: Final = ("humble", "iron", "jazzy", "kilted", "lyrical")

DEFAULT_DISTRIBUTION: Final = "jazzy"

_TIME: Final = parse_type("builtin_interfaces/msg/Time")
_UUID: Final = parse_type("unique_identifier_msgs/msg/UUID")
_EVENT_INFO: Final = parse_type("service_msgs/msg/ServiceEventInfo")
_SEPARATOR: Final = "---"
_SECTION_COUNTS: Final = {"msg": 1, "srv": 2, "action": 3}

# A field with a default value: `float64 w 1.0`.
_DEFAULT: Final = re.compile(r"[a-zA-Z][^\s#]*[ \t]+([a-zA-Z]\w*)[ \t]+([^\s=#].*)")

# defaults of well-known types, which rosbags leaves out
_DEFAULTS: Final[dict[str, dict[str, Any]]] = {
    "geometry_msgs/msg/Quaternion": {"w": 1.0},
    "type_description_interfaces/srv/GetTypeDescription_Request": {"include_type_sources": True},
}


class Definitions:
    """The known types.

    :param folders: packages, or folders with packages.
    :param distribution: the distribution of the well-known types; None for no such types.
    :param texts: further definitions by type, with less priority than files.
    :param environment: the environment with ``AMENT_PREFIX_PATH``; by default that of the process.
    :raises Ros2Error: if a folder or the distribution does not exist.
    """

    def __init__(
        self,
        folders: Iterable[Path | str] = (),
        distribution: str | None = DEFAULT_DISTRIBUTION,
        environment: Mapping[str, str] | None = None,
        texts: Mapping[str, str] | None = None,
    ) -> None:
        self._texts = {**BUILT_IN, **(texts or {})}
        self._store: Any = get_typestore(_store_of(distribution))
        for name, (constants, fields) in self._store.fielddefs.items():
            self._store.fielddefs[name] = (constants, _without_char(fields))
        self._files: dict[str, Path] = {}
        prefixes = (os.environ if environment is None else environment).get("AMENT_PREFIX_PATH", "")
        sourced = [Path(prefix) / "share" for prefix in prefixes.split(os.pathsep) if prefix]
        # reversed: the first folder is read last and replaces the files of the later ones
        for folder in (
            *reversed([folder for folder in sourced if folder.is_dir()]),
            *reversed([Path(folder) for folder in folders]),
        ):
            self._files.update(_files_in(folder))
        for name in self._files:  # files override well-known types, which may differ
            self._store.fielddefs.pop(name, None)
            self._store.types.pop(name, None)
        self._loaded: set[str] = set()
        # whether types have hashes and services have events, as since ROS 2 Iron
        self.has_hashes = str(_EVENT_INFO) in {*self._store.fielddefs, *self._files}
        self._defaults = dict(_DEFAULTS)

    # --- known types --------------------------------------------------------------------------------------

    def names(self) -> list[str]:
        """Return the names of all available types."""
        well_known = (name for name in self._store.fielddefs if str(_definition_of(parse_type(name))) == name)
        return sorted({*well_known, *self._files, *self._texts})

    def fields(self, name: TypeName) -> Sequence[tuple[str, FieldType]]:
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
        fields = dict(self.fields(name))
        if field not in fields:
            raise Ros2Error(
                f"{name} has no field '{field}'",
                hint=did_you_mean(field, fields, f"it has: {', '.join(fields)}"),
            )
        node, details = fields[field]
        if inner_path and node != Nodetype.NAME:
            raise Ros2Error(f"the field '{field}' of {name} has no fields in it: '{path}'")
        if inner_path:
            self.check_path(parse_type(details), inner_path)

    def defaults(self, name: TypeName) -> Mapping[str, Any]:
        """Return the defaults of fields that are not zero."""
        return self._defaults.get(str(name), {})

    def type_hash(self, name: TypeName) -> str:
        """Return the hash of a type: ``RIHS01_`` and 64 hexadecimal digits.

        :param name: a message, a service, an action, or a message derived from these.
        """
        self._load(name)
        return str(self._store.hash_rihs01(str(name)))

    @property
    def store(self) -> Any:
        """The type store of rosbags."""
        return self._store

    def embed(self, name: str, text: str) -> None:
        """Register a type from a recording, with its nested types. Known types stay unchanged.

        :raises Ros2Error: if the text is not a definition.
        """
        if name in self._store.fielddefs:
            return
        try:
            definitions = get_types_from_msg(text, name)
        except (TypesysError, ValueError) as error:
            raise Ros2Error(f"{name}: {' '.join(str(error).split())}") from None
        embedded: dict[str, tuple[list[Any], Fields]] = {
            nested_name: ([], _without_char(fields))
            for nested_name, (_, fields) in definitions.items()
            if nested_name not in self._store.fielddefs
        }
        self._store.register(embedded)
        self._loaded.update(embedded)

    # --- loading ------------------------------------------------------------------------------------------

    def _load(self, name: TypeName) -> None:
        """Load a type and its nested types into the store."""
        definition = _definition_of(name)
        if not self._loaded.isdisjoint((str(name), str(definition))):
            return
        if name.kind == "msg" and str(name) not in self._files and str(name) in self._store.fielddefs:
            self._loaded.add(str(name))
            self._load_nested(self._store.fielddefs[str(name)][1])
        else:
            self._register(definition)
        if str(name) not in self._store.fielddefs:
            raise self._unknown(name)

    def _register(self, name: TypeName) -> None:
        """Register a definition in the store, with the messages derived from it."""
        messages = dict(self._messages(name))
        # before the nested types, which may contain this type
        self._loaded.add(str(name))
        try:
            self._store.register({message: ([], fields) for message, fields in messages.items()})
        except TypesysError as error:
            raise Ros2Error(f"{name}: {error}", file=self._files.get(str(name))) from None
        for fields in messages.values():
            self._load_nested(fields, messages)

    def _load_nested(self, fields: Fields, registered: Collection[str] = ()) -> None:
        """Load the nested types of fields, except those just registered."""
        for _, kind in fields:
            nested = _nested_type(kind)
            if nested is not None and nested not in registered:
                self._load(parse_type(nested))

    def _messages(self, name: TypeName) -> Iterator[tuple[str, Fields]]:
        """Yield the messages of a definition with their fields."""
        sections, defaults = self._sections(name)
        suffixes = {"msg": (), "srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}
        section_names = [name.derived(suffix) for suffix in suffixes[name.kind]] or [name]
        self._defaults.update(zip(map(str, section_names), defaults, strict=True))
        if name.kind == "msg":
            yield str(name), sections[0]
        elif name.kind == "srv":
            yield from _service_messages(name, sections[0], sections[1], self.has_hashes)
        else:
            yield from _action_messages(name, sections, self.has_hashes)

    def _sections(self, name: TypeName) -> tuple[list[Fields], list[dict[str, Any]]]:
        """Return the fields and the defaults of each section of a definition."""
        file = self._files.get(str(name))
        if file is None and str(name) not in self._texts:
            raise self._unknown(name)
        try:
            text = self._texts[str(name)] if file is None else file.read_text("utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise Ros2Error(f"cannot read the definition of {name}: {error}", file=file) from None
        if file is not None and file.suffix == ".idl":
            return [_parse_idl(text, name, file)], [{}]
        sections = _split(text)
        if len(sections) != _SECTION_COUNTS[name.kind]:
            raise Ros2Error(
                f"{name} has {len(sections)} sections, {_SECTION_COUNTS[name.kind]} are wanted",
                file=file,
                hint=f"they are separated by lines with {_SEPARATOR}",
            )
        fields = [_parse_section(section, name, file, line) for line, section in sections]
        return fields, [_defaults_in(section) for _, section in sections]

    def _unknown(self, name: TypeName) -> Ros2Error:
        return Ros2Error(
            f"there is no ROS 2 type {name}",
            hint=did_you_mean(str(name), self.names(), "name the folder of its package"),
        )


def _store_of(distribution: str | None) -> Stores:
    if distribution is None:
        return Stores.EMPTY
    try:
        return Stores[f"ROS2_{distribution.upper()}"]
    except KeyError:
        raise Ros2Error(
            f"there is no ROS distribution '{distribution}' here",
            hint=did_you_mean(distribution, DISTRIBUTIONS),
        ) from None


# --- files --------------------------------------------------------------------------------------------------


def _files_in(folder: Path) -> dict[str, Path]:
    """Return the definition files of all packages in a folder, by type."""
    if not folder.is_dir():
        raise Ros2Error("there is no such folder with ROS packages", file=folder)
    definition_files: dict[str, Path] = {}
    for directory_name, folders, files in walk(folder):
        folders.sort()
        directory = Path(directory_name)
        if directory.name not in KINDS:
            continue
        package = _package_of(directory.parent)
        for file in sorted(files):
            path = directory / file
            if path.suffix in (f".{directory.name}", ".idl"):
                # an installed package has an .idl for each .msg; only the .msg has default values
                name = f"{package}/{directory.name}/{path.stem}"
                if path.suffix != ".idl" or name not in definition_files:
                    definition_files[name] = path
    # rosbags reads messages in IDL only
    return {name: path for name, path in definition_files.items() if path.suffix != ".idl" or "/msg/" in name}


def _package_of(folder: Path) -> str:
    """Return the name of a package from its package.xml, or the folder's name."""
    try:
        name = ET.parse(folder / "package.xml").getroot().findtext("name")  # noqa: S314 - the user's own file
    except (OSError, ET.ParseError):
        name = None
    return (name or folder.name).strip()


def _split(text: str) -> list[tuple[int, str]]:
    """Return the sections of a definition, each with the number of its first line."""
    sections: list[tuple[int, list[str]]] = [(1, [])]
    for number, line in enumerate(text.splitlines(), start=1):
        if line.strip() == _SEPARATOR:
            sections.append((number + 1, []))
        else:
            sections[-1][1].append(line)
    return [(line, "\n".join(lines)) for line, lines in sections]


def _parse_section(text: str, name: TypeName, file: Path | None, line: int) -> Fields:
    # nested types without a package belong to the same package
    as_message = f"{name.package}/msg/{name.name}"
    try:
        ((_, fields),) = get_types_from_msg(text, as_message).values()
    except (TypesysError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise Ros2Error(f"{name}: {reason}", file=file, line=line if file else None) from None
    # to rosbags, wstring is the name of a message in this package
    wide_types = (f"{name.package}/msg/wstring", f"{name.package}/msg/wchar")
    for field, kind in fields:
        if _nested_type(kind) in wide_types:
            raise Ros2Error(
                f"{name}: the field '{field}' is a wide string, which is not supported", file=file
            )
    return _without_char(fields)


def _defaults_in(text: str) -> dict[str, Any]:
    """Return the default values of fields, which rosbags ignores."""
    matches = (_DEFAULT.match(line.strip()) for line in text.splitlines())
    return {match[1]: yaml.safe_load(match[2]) for match in matches if match}


def _parse_idl(text: str, name: TypeName, file: Path) -> Fields:
    try:
        return _without_char(get_types_from_idl(text)[str(name)][1])
    except (TypesysError, KeyError, ValueError) as error:
        raise Ros2Error(f"{name}: {' '.join(str(error).split())}", file=file) from None


# --- messages derived from services and actions -------------------------------------------------------------


def _service_messages(
    name: TypeName, request: Fields, response: Fields, has_event: bool
) -> Iterator[tuple[str, Fields]]:
    """Yield a service's messages: request, response, event, and the type for its hash."""
    yield str(name.derived("Request")), request
    yield str(name.derived("Response")), response
    if not has_event:
        return
    yield (
        str(name.derived("Event")),
        [
            ("info", _named_type(_EVENT_INFO)),
            ("request", (Nodetype.SEQUENCE, (_named_type(name.derived("Request")), 1))),  # at most one
            ("response", (Nodetype.SEQUENCE, (_named_type(name.derived("Response")), 1))),
        ],
    )
    suffixes = ("Request", "Response", "Event")
    yield str(name), [(f"{suffix.lower()}_message", _named_type(name.derived(suffix))) for suffix in suffixes]


def _action_messages(
    name: TypeName, sections: list[Fields], has_events: bool
) -> Iterator[tuple[str, Fields]]:
    """Yield an action's messages: goal, result, feedback, and those of its services and topics."""
    goal, result, feedback = (name.derived(suffix) for suffix in ("Goal", "Result", "Feedback"))
    for section_name, fields in zip((goal, result, feedback), sections, strict=True):
        yield str(section_name), fields
    send_goal, get_result, feedback_message = (
        name.derived(suffix) for suffix in ("SendGoal", "GetResult", "FeedbackMessage")
    )
    goal_id = ("goal_id", _named_type(_UUID))
    acceptance: Fields = [("accepted", _base_type("bool")), ("stamp", _named_type(_TIME))]
    status_and_result: Fields = [("status", _base_type("int8")), ("result", _named_type(result))]
    yield from _service_messages(send_goal, [goal_id, ("goal", _named_type(goal))], acceptance, has_events)
    yield from _service_messages(get_result, [goal_id], status_and_result, has_events)
    yield str(feedback_message), [goal_id, ("feedback", _named_type(feedback))]
    if not has_events:
        return
    # the type of the action itself, whose hash peers compare
    members = {
        "goal": goal,
        "result": result,
        "feedback": feedback,
        "send_goal_service": send_goal,
        "get_result_service": get_result,
        "feedback_message": feedback_message,
    }
    yield str(name), [(field, _named_type(member)) for field, member in members.items()]


def _base_type(name: str) -> FieldType:
    return Nodetype.BASE, (name, 0)


def _named_type(name: TypeName) -> FieldType:
    return Nodetype.NAME, str(name)


def _without_char(fields: Fields) -> Fields:
    """Return fields with ``uint8`` in place of ``char``, as in IDL and type hashes."""
    return [(field, _replace_char(kind)) for field, kind in fields]


def _replace_char(kind: FieldType) -> FieldType:
    node, details = kind
    if node in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        return node, (_replace_char(details[0]), details[1])
    return _base_type("uint8") if node == Nodetype.BASE and details[0] == "char" else kind


def _nested_type(kind: FieldType) -> str | None:
    """Return the message type of a field or of its elements; None for base types."""
    node, details = kind
    if node in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        return _nested_type(details[0])
    return str(details) if node == Nodetype.NAME else None


# The longest suffixes first: SendGoal_Request ends with Request, too.
_DERIVED_SUFFIXES: Final = (
    *("SendGoal_Request", "SendGoal_Response", "SendGoal_Event", "GetResult_Request", "GetResult_Response"),
    *("GetResult_Event", "SendGoal", "GetResult", "FeedbackMessage", "Goal", "Result", "Feedback"),
    *("Request", "Response", "Event"),
)


def _definition_of(name: TypeName) -> TypeName:
    """Return the message, service or action with the definition of a type."""
    if name.kind != "msg":
        for suffix in _DERIVED_SUFFIXES:
            if name.name.endswith(f"_{suffix}"):
                return TypeName(name.package, name.kind, name.name.removesuffix(f"_{suffix}"))
    return name
