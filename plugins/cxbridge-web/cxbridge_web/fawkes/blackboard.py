"""Fawkes' REST API ``blackboard``: interfaces, their types and their values."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any, Final

from msgspec import UNSET, Struct, UnsetType

from cxbridge.blackboard import InterfaceInfo as BoardInfo
from cxbridge.clock import format_asctime
from cxbridge.errors import CxbridgeError, InterfaceError
from cxbridge.interfaces.schema import FieldSchema
from cxbridge.trace.codec import values_with_enum_names
from cxbridge_web.endpoint import ApiCall, ApiError, Endpoint
from cxbridge_web.models import Model

OWNER: Final = "BlackboardRestApi"  # name of the reader, as in Fawkes


class InterfaceFieldType(Struct):
    """A field of an interface or of a message."""

    name: str
    type: str
    is_array: bool
    enums: list[str]


class InterfaceMessageType(Struct):
    """A message of an interface."""

    name: str
    fields: list[InterfaceFieldType]


class InterfaceInfo(Model, kw_only=True):
    """An interface of the blackboard, with its type."""

    id: str
    type: str
    hash: str
    writer: str | UnsetType = UNSET
    readers: list[str]
    fields: list[InterfaceFieldType]
    message_types: list[InterfaceMessageType]


class InterfaceData(Model, kw_only=True):
    """The values of an interface."""

    id: str
    type: str
    writer: str | UnsetType = UNSET
    readers: list[str]
    data: dict[str, Any]
    timestamp: str


# as in Fawkes, the graph of the blackboard has the same model as that of the transforms
class TransformsGraph(Model, kw_only=True):
    """A graph in the dot language."""

    dotgraph: str


def _make_fields(fields: Iterable[FieldSchema]) -> list[InterfaceFieldType]:
    return [
        InterfaceFieldType(
            field.name,
            field.type,
            field.runtime_length > 1 and not field.is_string,
            [] if field.enum is None else [item.name for item in field.enum.items],
        )
        for field in fields
    ]


def _find_writer_owner(info: BoardInfo) -> str | UnsetType:
    return info.writer if info.has_writer else UNSET


def _make_info(call: ApiCall, info: BoardInfo) -> InterfaceInfo:
    fields: list[InterfaceFieldType] = []
    messages: list[InterfaceMessageType] = []
    with suppress(InterfaceError):  # an interface of another program, without a local definition
        schema = call.host.board.registry.get(info.type).SCHEMA
        fields = _make_fields(schema.fields)
        messages = [
            InterfaceMessageType(message.name, _make_fields(message.fields)) for message in schema.messages
        ]
    return InterfaceInfo(
        id=info.id,
        type=info.type,
        hash=info.hash.hex().upper(),
        writer=_find_writer_owner(info),
        readers=list(info.readers),
        fields=fields,
        message_types=messages,
    )


def find_interface(call: ApiCall) -> BoardInfo | None:
    """Return the interface of the path; None if it does not exist.

    :raises ApiError: if the type or the id in the path is a pattern.
    """
    type_and_id = call.path_values["type"], call.path_values["id"]
    for noun, name in zip(("Type", "ID"), type_and_id, strict=True):
        if "*" in name or "?" in name:
            raise ApiError(400, f"{noun} may not contain any of [*?].")
    infos = call.host.board.list_all()
    return next((info for info in infos if (info.type, info.id) == type_and_id), None)


def _list_interfaces(call: ApiCall) -> list[InterfaceInfo]:
    return [_make_info(call, info) for info in call.host.board.list_all()]


def _get_interface(call: ApiCall) -> InterfaceInfo:
    info = find_interface(call)
    if info is None:
        # the texts of Fawkes, with its colons
        raise ApiError(404, f"Interface {call.path_values['type']}:{call.path_values['id']} not found")
    return _make_info(call, info)


def _get_data(call: ApiCall) -> InterfaceData:
    info = find_interface(call)
    if info is None:
        uid = f"{call.path_values['type']}::{call.path_values['id']}"
        raise ApiError(404, f"Interface {uid}: is currently not available")
    try:
        return _read_interface_data(call, info)
    except CxbridgeError as error:
        raise ApiError(404, f"Failed to open {info.uid}: {error.message}") from error


def read_all_data(call: ApiCall, infos: Iterable[BoardInfo]) -> list[InterfaceData]:
    """Return the values of interfaces.

    An interface that cannot be opened, e.g. without a local definition, is left out.
    """
    models = []
    for info in infos:
        with suppress(CxbridgeError):
            models.append(_read_interface_data(call, info))
    return models


def _read_interface_data(call: ApiCall, info: BoardInfo) -> InterfaceData:
    """Return the values of an interface.

    :raises CxbridgeError: if the interface cannot be opened.
    """
    with call.host.board.open_for_reading(info.type, info.id, owner=OWNER) as instance:
        instance.read()
        values = values_with_enum_names(instance.as_dict())
        return InterfaceData(
            id=info.id,
            type=info.type,
            writer=_find_writer_owner(info),
            readers=list(info.readers),
            data={field.name: _convert_value(field, values[field.name]) for field in instance.fields()},
            timestamp=format_asctime(instance.timestamp_us),
        )


def _convert_value(field: FieldSchema, value: Any) -> Any:
    """Return a value in the form of Fawkes' introspection, where an array of length 1 is its element."""
    if isinstance(value, bytes | bytearray):
        value = list(value)
    if field.is_array and field.runtime_length == 1 and isinstance(value, Sequence):
        return value[0]
    return value


# -- the graph


def _get_graph(call: ApiCall) -> TransformsGraph:
    infos = sorted(call.host.board.list_all(), key=lambda info: (info.type, info.id))
    return TransformsGraph(dotgraph=make_graph(infos))


def make_graph(infos: Sequence[BoardInfo]) -> str:
    """Return the graph of readers and writers in the dot language."""
    lines = ["digraph bbmap {", "  graph [fontsize=12,rankdir=LR];"]
    lines += ["  node [fontsize=12 shape=box width=4 margin=0.05];", "  { rank=same; "]
    for info in infos:
        # As in Fawkes' graph: red without a writer, purple for a writer without a name.
        colour = "" if info.writer else " color=purple" if info.has_writer else " color=red"
        lines.append(f"    {quote_dot(info.uid)} [href={quote_dot(f'/blackboard/view/{info.uid}')}{colour}];")
    lines += ["  }", "  node [fontsize=12 shape=octagon width=3];"]
    owners = {owner for info in infos for owner in (info.writer, *info.readers) if owner}
    lines += [
        f"  {quote_dot(owner)} [href={quote_dot(f'/blackboard/graph/{owner}')}];" for owner in sorted(owners)
    ]
    for info in infos:
        readers = " ".join(map(quote_dot, info.readers))
        lines.append(
            f"  {quote_dot(info.uid)} -> {{ {readers} }} [style=dashed arrowhead=dot arrowsize=0.5 dir=both];"
        )
        if info.has_writer:
            colour = '"#008800"' if info.writer else "purple"
            lines.append(f"  {quote_dot(info.writer or '???')} -> {quote_dot(info.uid)} [color={colour}];")
    return "\n".join([*lines, "}"])


def quote_dot(name: str) -> str:
    """Return a name as an identifier of the dot language."""
    escaped_name = name.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped_name}"'


def _make_endpoint(path: str, handler: Any, reply: Any, summary: str, **options: Any) -> Endpoint:
    return Endpoint(
        method="GET", path=f"/blackboard{path}", handler=handler, reply=reply, summary=summary, **options
    )


_ERRORS: Final = {400: "The type or the id is a pattern", 404: "The interface does not exist"}

ENDPOINTS: Final = (
    _make_endpoint("/interfaces", _list_interfaces, list[InterfaceInfo], "All interfaces."),
    _make_endpoint(
        "/interfaces/{type}/{id+}/data",
        _get_data,
        InterfaceData,
        "The values of an interface.",
        errors=_ERRORS,
    ),
    _make_endpoint(
        "/interfaces/{type}/{id+}", _get_interface, InterfaceInfo, "An interface.", errors=_ERRORS
    ),
    _make_endpoint(
        "/graph",
        _get_graph,
        TransformsGraph,
        "The graph of the interfaces with their readers and writers, in the dot language.",
    ),
)
