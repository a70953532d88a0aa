"""The component ``blackboard``: interfaces, their types and their values."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any, Final

from cxbridge.blackboard import InterfaceInfo
from cxbridge.clock import split_us
from cxbridge.errors import CxbridgeError, InterfaceError
from cxbridge.interfaces.schema import FieldSchema
from cxbridge.trace.codec import plain_values
from cxbridge_web.endpoint import API_VERSION, ApiCall, ApiError, Endpoint

OWNER: Final = "BlackboardRestApi"
_EPOCH_S: Final = 1_000_000_000
"""Earlier times are given as numbers."""


def _fields(fields: Iterable[FieldSchema]) -> list[dict[str, Any]]:
    return [
        {
            "name": field.name,
            "type": field.type,
            "is_array": field.runtime_length > 1 and not field.is_string,
            "enums": [] if field.enum is None else [item.name for item in field.enum.items],
        }
        for field in fields
    ]


def _owners(info: InterfaceInfo) -> dict[str, Any]:
    writer = {"writer": info.writer} if info.has_writer else {}
    return {**writer, "readers": list(info.readers)}


def _info(call: ApiCall, info: InterfaceInfo) -> dict[str, Any]:
    fields: list[dict[str, Any]] = []
    messages: list[dict[str, Any]] = []
    try:
        schema = call.host.board.registry.get(info.type).SCHEMA
    except InterfaceError:
        pass  # a foreign interface without a definition here
    else:
        fields = _fields(schema.fields)
        messages = [{"name": message.name, "fields": _fields(message.fields)} for message in schema.messages]
    return {
        "kind": "InterfaceInfo",
        "apiVersion": API_VERSION,
        "id": info.id,
        "type": info.type,
        "hash": info.hash.hex().upper(),
        **_owners(info),
        "fields": fields,
        "message_types": messages,
    }


def find(call: ApiCall) -> InterfaceInfo | None:
    """Return the interface that the path names.

    :raises ApiError: when the path is a pattern.
    """
    wanted = call.path["type"], call.path["id"]
    for part, name in zip(("Type", "ID"), wanted, strict=True):
        if "*" in name or "?" in name:
            raise ApiError(400, f"{part} may not contain any of [*?].")
    infos = call.host.board.list_all()
    return next((info for info in infos if (info.type, info.id) == wanted), None)


def _list(call: ApiCall) -> list[dict[str, Any]]:
    return [_info(call, info) for info in call.host.board.list_all()]


def _one(call: ApiCall) -> dict[str, Any]:
    info = find(call)
    if info is None:
        raise ApiError(404, f"Interface {call.path['type']}:{call.path['id']} not found")
    return _info(call, info)


def _data(call: ApiCall) -> dict[str, Any]:
    info = find(call)
    if info is None:
        uid = f"{call.path['type']}::{call.path['id']}"
        raise ApiError(404, f"Interface {uid}: is currently not available")
    try:
        return _data_model(call, info)
    except CxbridgeError as error:
        raise ApiError(404, f"Failed to open {info.uid}: {error.message}") from error


def data_models(call: ApiCall, infos: Iterable[InterfaceInfo]) -> list[dict[str, Any]]:
    """Return the values of interfaces; those of which there is no definition here are left out."""
    models = []
    for info in infos:
        with suppress(CxbridgeError):
            models.append(_data_model(call, info))
    return models


def _data_model(call: ApiCall, info: InterfaceInfo) -> dict[str, Any]:
    """Return the values of an interface.

    :raises CxbridgeError: when it cannot be opened.
    """
    board = call.host.board
    instance = board.open_for_reading(info.type, info.id, owner=OWNER)
    try:
        instance.read()
        values = plain_values(instance.as_dict())
        time_us = instance.timestamp_us
        fields = instance.fields()
    finally:
        board.close(instance)
    return {
        "kind": "InterfaceData",
        "apiVersion": API_VERSION,
        "id": info.id,
        "type": info.type,
        **_owners(info),
        "data": {field.name: _value(field, values[field.name]) for field in fields},
        "timestamp": _stamp(time_us),
    }


def _value(field: FieldSchema, value: Any) -> Any:
    """Return a value as Fawkes' introspection has it: of an array of one its element."""
    if isinstance(value, bytes | bytearray):
        value = list(value)
    if field.is_array and field.runtime_length == 1 and isinstance(value, Sequence):
        return value[0]
    return value


def _stamp(time_us: int) -> str:
    seconds, microseconds = split_us(time_us)
    if seconds < _EPOCH_S:
        return f"{seconds}:{microseconds}"
    return time.asctime(time.localtime(seconds))


# -- the graph


def _graph(call: ApiCall) -> dict[str, Any]:
    infos = sorted(call.host.board.list_all(), key=lambda info: (info.type, info.id))
    return {"kind": "TransformsGraph", "apiVersion": API_VERSION, "dotgraph": graph(infos)}


def graph(infos: Sequence[InterfaceInfo]) -> str:
    """Return who reads and writes what, in the dot language."""
    lines = ["digraph bbmap {", "  graph [fontsize=12,rankdir=LR];"]
    lines += ["  node [fontsize=12 shape=box width=4 margin=0.05];", "  { rank=same; "]
    for info in infos:
        colour = "" if info.writer else " color=purple" if info.has_writer else " color=red"
        lines.append(f"    {_quoted(info.uid)} [href={_quoted(f'/blackboard/view/{info.uid}')}{colour}];")
    lines += ["  }", "  node [fontsize=12 shape=octagon width=3];"]
    owners = {owner for info in infos for owner in (info.writer, *info.readers) if owner}
    lines += [
        f"  {_quoted(owner)} [href={_quoted(f'/blackboard/graph/{owner}')}];" for owner in sorted(owners)
    ]
    for info in infos:
        readers = " ".join(map(_quoted, info.readers))
        lines.append(
            f"  {_quoted(info.uid)} -> {{ {readers} }} [style=dashed arrowhead=dot arrowsize=0.5 dir=both];"
        )
        if info.has_writer:
            colour = '"#008800"' if info.writer else "purple"
            lines.append(f"  {_quoted(info.writer or '???')} -> {_quoted(info.uid)} [color={colour}];")
    return "\n".join([*lines, "}"])


def _quoted(name: str) -> str:
    escaped = name.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def _get(path: str, handler: Any, reply: str, about: str, **more: Any) -> Endpoint:
    return Endpoint(
        method="GET", path=f"/blackboard{path}", handler=handler, reply=reply, about=about, **more
    )


_ERRORS: Final = {400: "Type or id is a pattern", 404: "There is no such interface"}

ENDPOINTS: Final = (
    _get("/interfaces", _list, "InterfaceInfo", "All interfaces.", many=True),
    _get(
        "/interfaces/{type}/{id+}/data", _data, "InterfaceData", "The values of an interface.", errors=_ERRORS
    ),
    _get("/interfaces/{type}/{id+}", _one, "InterfaceInfo", "One interface.", errors=_ERRORS),
    _get("/graph", _graph, "TransformsGraph", "Who reads and writes what, in the dot language."),
)
