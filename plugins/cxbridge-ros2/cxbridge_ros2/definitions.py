"""Definitions of messages, services and actions, from .msg, .srv, .action and .idl files.

Sources in order: the user's folders, a sourced ROS environment (``AMENT_PREFIX_PATH``), and the well-known
types of a ROS distribution from rosbags. A file is read when a type of it is requested.

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
_SECTIONS: Final = {"msg": 1, "srv": 2, "action": 3}

# A field with a default value.
_DEFAULT: Final = re.compile(r"[a-zA-Z][^\s#]*[ \t]+([a-zA-Z]\w*)[ \t]+([^\s=#].*)")

# defaults of well-known types, which rosbags leaves out
_DEFAULTS: Final[dict[str, dict[str, Any]]] = {
    "geometry_msgs/msg/Quaternion": {"w": 1.0},
    "type_description_interfaces/srv/GetTypeDescription_Request": {"include_type_sources": True},
}


class Definitions:
    """The known types.

    :param folders: packages, or folders with packages.
    :param distribution: the distribution of the well-known types; None for none.
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
        # The type char of ROS is uint8 in IDL, also for the hash.
        for name, (constants, fields) in self._store.fielddefs.items():
            self._store.fielddefs[name] = (constants, [(each, _plain(kind)) for each, kind in fields])
        self._files: dict[str, Path] = {}
        known = os.environ if environment is None else environment
        sourced = [
            Path(each) / "share" for each in known.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if each
        ]
        for folder in (
            *reversed([each for each in sourced if each.is_dir()]),
            *reversed([Path(each) for each in folders]),
        ):
            self._files.update(_files_in(folder))
        for each in self._files:  # files override well-known types, which may differ
            self._store.fielddefs.pop(each, None)
            self._store.types.pop(each, None)
        self._read: set[str] = set()
        # Whether types have hashes and services have events: since ROS 2 Iron.
        self.has_hashes = str(_EVENT_INFO) in {*self._store.fielddefs, *self._files}
        self._defaults = dict(_DEFAULTS)

    # --- known types --------------------------------------------------------------------------------------

    def names(self) -> list[str]:
        """Return the names of all available types."""
        well_known = (name for name in self._store.fielddefs if _is_whole(name))
        return sorted({*well_known, *self._files, *self._texts})

    def fields(self, name: TypeName) -> Sequence[tuple[str, FieldType]]:
        """Return the fields of a message in order.

        :raises Ros2Error: if the type is unknown, or its file is broken.
        """
        self._need(name)
        found: Sequence[tuple[str, FieldType]] = self._store.fielddefs[str(name)][1]
        return found

    def lacking(self, name: TypeName, path: str) -> tuple[str, list[str]] | None:
        """Return the first part of a dotted path that a message lacks, and the fields there; or None.

        :raises Ros2Error: if the type is unknown, or its file is broken.
        """
        for part in path.split("."):
            fields = dict(self.fields(name))
            if part not in fields:
                return part, list(fields)
            inner = _nested(fields[part])
            if inner is None:
                return None
            name = parse_type(inner)
        return None

    def defaults(self, name: TypeName) -> Mapping[str, Any]:
        """Return the defaults of fields that are not zero."""
        return self._defaults.get(str(name), {})

    def type_hash(self, name: TypeName) -> str:
        """Return the hash of a type: ``RIHS01_`` and 64 hexadecimal digits.

        :param name: a message, a service, an action, or a part of these.
        """
        self._need(name)
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
        new: dict[str, tuple[list[Any], Fields]] = {
            key: ([], [(each, _plain(kind)) for each, kind in fields])
            for key, (_, fields) in definitions.items()
            if key not in self._store.fielddefs
        }
        self._store.register(new)
        self._read.update(new)

    # --- reading ------------------------------------------------------------------------------------------

    def _need(self, name: TypeName) -> None:
        """Load a type and its nested types into the store."""
        whole = _whole(name)
        for each in {str(name), str(whole)}:
            if each in self._read:
                return
        if name.kind == "msg" and str(name) not in self._files and str(name) in self._store.fielddefs:
            self._read.add(str(name))
            self._need_nested(self._store.fielddefs[str(name)][1])
        else:
            self._define(whole)
        if str(name) not in self._store.fielddefs:
            raise Ros2Error(
                f"there is no ROS 2 type {name}",
                hint=did_you_mean(str(name), self.names(), "name its package's folder"),
            )

    def _define(self, name: TypeName) -> None:
        """Load a type into the store, with the messages derived from it."""
        generated = dict(self._made_of(name))
        self._read.add(str(name))
        try:
            self._store.register({key: ([], value) for key, value in generated.items()})
        except TypesysError as error:
            raise Ros2Error(f"{name}: {error}", file=self._files.get(str(name))) from None
        for fields in generated.values():
            self._need_nested(fields, generated)

    def _need_nested(self, fields: Fields, type_names: Collection[str] = ()) -> None:
        """Load the nested types of fields, except those just made."""
        for _, kind in fields:
            nested = _nested(kind)
            if nested is not None and nested not in type_names:
                self._need(parse_type(nested))

    def _made_of(self, name: TypeName) -> Iterator[tuple[str, Fields]]:
        parts, defaults = self._parts(name)
        for part, values in zip(_parts_of(name), defaults, strict=True):
            self._defaults[str(part)] = values
        if name.kind == "msg":
            yield str(name), parts[0]
        elif name.kind == "srv":
            yield from _service(name, parts[0], parts[1], self.has_hashes)
        else:
            yield from _action(name, parts, self.has_hashes)

    def _parts(self, name: TypeName) -> tuple[list[Fields], list[dict[str, Any]]]:
        """Return the fields and the defaults of each section of a definition."""
        file = self._files.get(str(name))
        try:
            text = self._texts[str(name)] if file is None else file.read_text("utf-8")
        except KeyError:
            hint = did_you_mean(str(name), self.names(), "name the folder of its package")
            raise Ros2Error(f"there is no ROS 2 type {name}", hint=hint) from None
        except (OSError, UnicodeDecodeError) as error:
            raise Ros2Error(f"cannot read the definition of {name}: {error}", file=file) from None
        if file is not None and file.suffix == ".idl":
            return [_parse_idl(text, name, file)], [{}]
        sections = _split(text)
        if len(sections) != _SECTIONS[name.kind]:
            raise Ros2Error(
                f"{name} has {len(sections)} sections, {_SECTIONS[name.kind]} are wanted",
                file=file,
                hint=f"they are separated by lines with {_SEPARATOR}",
            )
        fields = [_parse(section, name, file, line) for line, section in sections]
        return fields, [_defaults_in(section) for _, section in sections]


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
                # An installed package has both files; only the original has defaults.
                name = f"{package}/{directory.name}/{path.stem}"
                if path.suffix != ".idl" or name not in definition_files:
                    definition_files[name] = path
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


def _parse(text: str, name: TypeName, file: Path | None, line: int) -> Fields:
    # nested types without a package belong to the same package
    as_message = f"{name.package}/msg/{name.name}"
    try:
        ((_, fields),) = get_types_from_msg(text, as_message).values()
    except (TypesysError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise Ros2Error(f"{name}: {reason}", file=file, line=line if file else None) from None
    plain_fields = [(each, _plain(kind)) for each, kind in fields]
    for field, kind in plain_fields:
        if _nested(kind) in (f"{name.package}/msg/wstring", f"{name.package}/msg/wchar"):
            raise Ros2Error(
                f"{name}: the field '{field}' is a wide string, which is not supported", file=file
            )
    return plain_fields


def _defaults_in(text: str) -> dict[str, Any]:
    matches = (_DEFAULT.match(line.strip()) for line in text.splitlines())
    return {each[1]: yaml.safe_load(each[2]) for each in matches if each}


def _parse_idl(text: str, name: TypeName, file: Path) -> Fields:
    try:
        types = get_types_from_idl(text)
        return [(each, _plain(kind)) for each, kind in types[str(name)][1]]
    except (TypesysError, KeyError, ValueError) as error:
        raise Ros2Error(f"{name}: {' '.join(str(error).split())}", file=file) from None


# --- messages derived from services and actions


def _service(
    name: TypeName, request: Fields, response: Fields, has_event: bool
) -> Iterator[tuple[str, Fields]]:
    """Yield a service's messages: request, response, event, and the type for its hash."""
    parts = {each: name.derived(each) for each in ("Request", "Response", "Event")}
    yield str(parts["Request"]), request
    yield str(parts["Response"]), response
    if not has_event:
        return
    yield (
        str(parts["Event"]),
        [
            ("info", _is(_EVENT_INFO)),
            ("request", _at_most_one(parts["Request"])),
            ("response", _at_most_one(parts["Response"])),
        ],
    )
    yield str(name), [(f"{each.lower()}_message", _is(part)) for each, part in parts.items()]


def _action(name: TypeName, parts: list[Fields], has_events: bool) -> Iterator[tuple[str, Fields]]:
    """Yield an action's messages: goal, result, feedback, and those of its services and topics."""
    goal, result, feedback = (name.derived(each) for each in ("Goal", "Result", "Feedback"))
    for part, fields in zip((goal, result, feedback), parts, strict=True):
        yield str(part), fields
    send, get, message = (name.derived(each) for each in ("SendGoal", "GetResult", "FeedbackMessage"))
    goal_id = ("goal_id", _is(_UUID))
    accepted: Fields = [("accepted", _base("bool")), ("stamp", _is(_TIME))]
    yield from _service(send, [goal_id, ("goal", _is(goal))], accepted, has_events)
    yield from _service(get, [goal_id], [("status", _base("int8")), ("result", _is(result))], has_events)
    yield str(message), [goal_id, ("feedback", _is(feedback))]
    if not has_events:
        return
    whole = {
        "goal": goal,
        "result": result,
        "feedback": feedback,
        "send_goal_service": send,
        "get_result_service": get,
        "feedback_message": message,
    }
    yield str(name), [(field, _is(part)) for field, part in whole.items()]


def _base(name: str) -> FieldType:
    return Nodetype.BASE, (name, 0)


def _is(name: TypeName) -> FieldType:
    return Nodetype.NAME, str(name)


def _at_most_one(name: TypeName) -> FieldType:
    return Nodetype.SEQUENCE, (_is(name), 1)


def _plain(kind: FieldType) -> FieldType:
    """Return a type with ``uint8`` in place of ``char``."""
    node, rest = kind
    if node in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        return node, (_plain(rest[0]), rest[1])
    return (node, ("uint8", 0)) if node == Nodetype.BASE and rest[0] == "char" else kind


def _nested(kind: FieldType) -> str | None:
    node, rest = kind
    if node in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        return _nested(rest[0])
    return str(rest) if node == Nodetype.NAME else None


_MADE: Final = (
    *("SendGoal_Request", "SendGoal_Response", "SendGoal_Event", "GetResult_Request", "GetResult_Response"),
    *("GetResult_Event", "SendGoal", "GetResult", "FeedbackMessage", "Goal", "Result", "Feedback"),
    *("Request", "Response", "Event"),
)


def _parts_of(name: TypeName) -> list[TypeName]:
    """Return the names of the messages that a definition contains."""
    parts = {"msg": (), "srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}[name.kind]
    return [name.derived(part) for part in parts] or [name]


def _whole(name: TypeName) -> TypeName:
    """Return the service or action that a type is a part of, or the type itself."""
    if name.kind != "msg":
        for part in _MADE:
            if name.name.endswith(f"_{part}"):
                return TypeName(name.package, name.kind, name.name.removesuffix(f"_{part}"))
    return name


def _is_whole(name: str) -> bool:
    type_name = parse_type(name)
    return _whole(type_name) == type_name
