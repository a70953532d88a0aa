"""The models of the API: the base of the types of answers, and the JSON schemas of all types."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any, Final, cast

import msgspec
from msgspec import UNSET, Struct, UnsetType
from msgspec.structs import fields

API_VERSION: Final = "v1beta1"
"""Of all models."""

Schema = dict[str, Any]

_REFERENCE: Final = "#/components/schemas/{name}"


class Model(Struct, kw_only=True, tag_field="kind", tag=True):
    """An answer of the API; its member ``kind`` is the name of the class.

    Each model is ``kw_only``, or msgspec puts ``apiVersion`` behind its members.
    """

    apiVersion: str = API_VERSION  # noqa: N815 - Fawkes' name of the member


class Request(Struct, kw_only=True):
    """The body of a request of Fawkes' API: it may name its kind."""

    kind: str | UnsetType = UNSET
    apiVersion: str | UnsetType = UNSET  # noqa: N815 - Fawkes' name of the member


@cache
def model_of(kind: str, answer: type[Struct]) -> type[Model]:
    """Return the model whose members are those of the answer of an operation."""
    members = [
        (each.name, each.type) if each.required else (each.name, each.type, each.default)
        for each in fields(answer)
    ]
    about = {"__doc__": answer.__doc__}
    made = msgspec.defstruct(kind, members, bases=(Model,), namespace=about, kw_only=True)
    return cast("type[Model]", made)


def plain(value: object) -> Any:
    """Return an answer as the module json knows it, or bytes."""
    return msgspec.to_builtins(value, builtin_types=(bytes, bytearray, memoryview), enc_hook=_simple)


def _simple(value: object) -> Any:
    """Return a value that msgspec does not know in a form that it knows."""
    return dict(value) if isinstance(value, Mapping) else str(value)


def schema_of(type_: Any) -> Schema:
    """Return the JSON schema of a type; a model is a reference."""
    (schema,), _ = msgspec.json.schema_components([type_], ref_template=_REFERENCE)
    return schema


def schemas(answers: Iterable[Any], bodies: Iterable[Any]) -> dict[str, Schema]:
    """Return the JSON schemas of all models by name.

    An answer has each member that is never left out, a body may lack members that have a default.
    """
    _, given = msgspec.json.schema_components(bodies, ref_template=_REFERENCE)
    _, found = msgspec.json.schema_components(answers, ref_template=_REFERENCE)
    return given | {name: _complete(schema) for name, schema in found.items()}


def _complete(schema: Schema) -> Schema:
    """Return the schema of an answer: it always has a member with a default value."""
    required = [
        name
        for name, member in schema.get("properties", {}).items()
        if name in schema["required"] or "default" in member
    ]
    return schema | {"required": required}
