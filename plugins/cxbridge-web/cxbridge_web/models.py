"""The base classes of the API's answers and request bodies, and their JSON schemas."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any, Final, Literal, cast

import msgspec
from msgspec import UNSET, Struct, UnsetType
from msgspec.structs import fields

API_VERSION: Final = "v1beta1"  # version of all models

Schema = dict[str, Any]

_REFERENCE: Final = "#/components/schemas/{name}"


class Model(Struct, kw_only=True, tag_field="kind", tag=True):
    """An answer of the API; its member ``kind`` is the name of the class.

    Each model is ``kw_only``; msgspec would otherwise put ``apiVersion`` after its members.
    """

    apiVersion: str = API_VERSION  # noqa: N815 - Fawkes' name of the member


class RequestBody(Struct, kw_only=True):
    """The body of a request of Fawkes' API, which may name its kind."""

    kind: str | UnsetType = UNSET
    apiVersion: str | UnsetType = UNSET  # noqa: N815 - Fawkes' name of the member


def define_model(
    name: str,
    docstring: str | None,
    members: Iterable[tuple[Any, ...]],
    rename: Literal["kebab"] | None = None,
) -> type[Model]:
    """Return a model whose members the code does not access by name.

    :param members: the name and the type of each member, and the default of an optional member.
    :param rename: ``kebab`` for names with dashes in JSON; None for unchanged names.
    """
    model = msgspec.defstruct(
        name, members, bases=(Model,), namespace={"__doc__": docstring}, kw_only=True, rename=rename
    )
    return cast("type[Model]", model)


@cache
def make_model(kind: str, answer: type[Struct]) -> type[Model]:
    """Return the model with the members of an operation's answer.

    :param kind: the name of the model.
    """
    members = [
        (field.name, field.type) if field.required else (field.name, field.type, field.default)
        for field in fields(answer)
    ]
    return define_model(kind, answer.__doc__, members)


def convert_unknown(value: object) -> Any:
    """Replace a value that msgspec cannot encode: return a dictionary for a mapping, else a text."""
    return dict(value) if isinstance(value, Mapping) else str(value)


def make_schema(value_type: Any) -> Schema:
    """Return the JSON schema of a type; for a model, a reference to its schema."""
    (schema,), _ = msgspec.json.schema_components([value_type], ref_template=_REFERENCE)
    return schema


def make_schemas(answers: Iterable[Any], bodies: Iterable[Any]) -> dict[str, Schema]:
    """Return the JSON schemas of all models by name.

    An answer always has the members with a default, so its schema requires them; a body may lack them.
    """
    _, body_schemas = msgspec.json.schema_components(bodies, ref_template=_REFERENCE)
    _, answer_schemas = msgspec.json.schema_components(answers, ref_template=_REFERENCE)
    return body_schemas | {name: _require_defaults(schema) for name, schema in answer_schemas.items()}


def _require_defaults(schema: Schema) -> Schema:
    """Return the schema of an answer, where members with a default are required."""
    required = [
        name
        for name, member in schema.get("properties", {}).items()
        if name in schema["required"] or "default" in member
    ]
    return schema | {"required": required}


def to_json(value: Any, *, is_pretty: bool = False) -> bytes:
    """Return a value as JSON. NaN and infinities become null, lone surrogates become question marks."""
    try:
        json_bytes = msgspec.json.encode(value, enc_hook=convert_unknown)
    except UnicodeEncodeError:  # a lone surrogate; rare, so only then is the whole value converted
        members = msgspec.to_builtins(value, enc_hook=convert_unknown)
        replaced_bytes = json.dumps(members, ensure_ascii=False).encode("utf-8", "replace")
        # encoded again, since only msgspec turns NaN into null
        json_bytes = msgspec.json.encode(json.loads(replaced_bytes))
    return msgspec.json.format(json_bytes, indent=4) if is_pretty else json_bytes
