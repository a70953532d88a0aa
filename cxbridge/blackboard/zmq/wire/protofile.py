"""Protobuf classes from a .proto file, made when the program runs: no generated file, no tool.

Reads as much of proto3 as envelope.proto has: ``message`` and ``enum`` at the top, ``oneof``, ``repeated``,
scalar types, and types of the same file.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from google.protobuf import (
    descriptor_pb2,
    descriptor_pool,
    message_factory,
)

_PACKAGE = re.compile(r"^package\s+([\w.]+)\s*;", re.MULTILINE)
_BLOCK = re.compile(r"^(message|enum)\s+(\w+)\s*\{(.*?)^\}", re.MULTILINE | re.DOTALL)
_ONEOF = re.compile(r"oneof\s+(\w+)\s*\{(.*?)\}", re.DOTALL)
_FIELD = re.compile(r"(repeated\s+)?(\w+)\s+(\w+)\s*=\s*(\d+)\s*;")
_VALUE = re.compile(r"(\w+)\s*=\s*(\d+)\s*;")
_COMMENT = re.compile(r"//[^\n]*")

_Field = descriptor_pb2.FieldDescriptorProto
_SCALARS: Final[Mapping[str, int]] = {
    "bool": _Field.TYPE_BOOL,
    "bytes": _Field.TYPE_BYTES,
    "int64": _Field.TYPE_INT64,
    "string": _Field.TYPE_STRING,
    "uint32": _Field.TYPE_UINT32,
    "uint64": _Field.TYPE_UINT64,
}


def describe(path: Path) -> Any:
    """Return the file as a ``FileDescriptorProto``.

    :raises ValueError: when it uses what is not understood here.
    """
    text = _COMMENT.sub("", path.read_text(encoding="utf-8"))
    package = _PACKAGE.search(text)
    if package is None:
        raise ValueError(f"{path}: no package")
    file = descriptor_pb2.FileDescriptorProto(name=path.name, package=package[1], syntax="proto3")
    blocks = _BLOCK.findall(text)
    kinds = {name: kind for kind, name, _ in blocks}
    for kind, name, body in blocks:
        if kind == "enum":
            enum = file.enum_type.add(name=name)
            for value, number in _VALUE.findall(body):
                # as in C, the values of a package share one scope: the descriptor wants them unique
                enum.value.add(name=f"{name}_{value}", number=int(number))
        else:
            _add_message(file, name, body, kinds)
    return file


def load(path: Path) -> tuple[dict[str, Any], dict[str, dict[str, int]]]:
    """Return the classes of all messages, and the numbers of all enums, by name.

    :raises ValueError: when the file uses what is not understood here.
    """
    file = describe(path)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file) if hasattr(pool, "Add") else pool.AddSerializedFile(file.SerializeToString())
    classes = {
        message.name: message_factory.GetMessageClass(
            pool.FindMessageTypeByName(f"{file.package}.{message.name}")
        )
        for message in file.message_type
    }
    enums = {
        enum.name: {value.name.removeprefix(f"{enum.name}_"): value.number for value in enum.value}
        for enum in file.enum_type
    }
    return classes, enums


def _add_message(file: Any, name: str, body: str, kinds: Mapping[str, str]) -> None:
    """Add a message with its fields."""
    message = file.message_type.add(name=name)
    for choice, fields in _ONEOF.findall(body):
        message.oneof_decl.add(name=choice)
        for field in _FIELD.findall(fields):
            _add_field(message, file.package, kinds, field).oneof_index = len(message.oneof_decl) - 1
    for field in _FIELD.findall(_ONEOF.sub("", body)):
        _add_field(message, file.package, kinds, field)


def _add_field(message: Any, package: str, kinds: Mapping[str, str], field: tuple[str, ...]) -> Any:
    """Add a field: whether it is repeated, its type, its name, its number."""
    repeated, type_name, name, number = field
    added = message.field.add(name=name, number=int(number))
    added.label = _Field.LABEL_REPEATED if repeated else _Field.LABEL_OPTIONAL
    if type_name in _SCALARS:
        added.type = _SCALARS[type_name]
    elif type_name in kinds:
        added.type = _Field.TYPE_ENUM if kinds[type_name] == "enum" else _Field.TYPE_MESSAGE
        added.type_name = f".{package}.{type_name}"
    else:
        raise ValueError(f"{message.name}.{name}: there is no type {type_name}")
    return added
