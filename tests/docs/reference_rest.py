"""The routes and the models of the REST API, as the OpenAPI document has them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any


@cache
def make_document() -> Mapping[str, Any]:
    """Return the OpenAPI document of a daemon."""
    from cxbridge_web import endpoint_table, openapi

    return openapi.make_document(endpoint_table.make_endpoint_table().endpoints)


def routes() -> Iterator[str]:
    """Yield a table of routes for each component."""
    component = ""
    for path, methods in sorted(make_document()["paths"].items()):
        if path.split("/")[1] != component:
            component = path.split("/")[1]
            yield from (
                *([""] if component != "backends" else []),
                f"#### {component}",
                "",
                "| route | effect | reply |",
                "| --- | --- | --- |",
            )
        for method, operation in methods.items():
            route = f"`{method.upper()} {path}`{_inputs(operation)}"
            yield f"| {route} | {_cell(operation['summary'])} | {_reply(operation)} |"


def models() -> Iterator[str]:
    """Yield a row for each model: its fields."""
    yield from ("| model | fields |", "| --- | --- |")
    for name, schema in sorted(make_document()["components"]["schemas"].items()):
        fields = schema.get("properties", {})
        silent = {"kind", "apiVersion"} if "apiVersion" in fields else set()
        required = schema.get("required", ())
        shown = (
            _field(field, kind, field in required) for field, kind in fields.items() if field not in silent
        )
        yield f"| `{name}` | {', '.join(shown)} |"


def _field(name: str, schema: Mapping[str, Any], required: bool) -> str:
    kind = schema.get("items", schema)
    of = " or ".join(
        choice["$ref"].rpartition("/")[2] for choice in kind.get("anyOf", [kind]) if "$ref" in choice
    )
    values = "|".join(map(str, kind.get("enum", ())))
    notes = "; ".join(
        filter(None, (of, values and f"`{_cell(values)}`", _cell(schema.get("description", ""))))
    )
    mark = ("[]" if "items" in schema else "") + ("" if required else "?")
    return f"`{name}{mark}`{f' ({notes})' if notes else ''}"


def _inputs(operation: Mapping[str, Any]) -> str:
    names = [parameter["name"] for parameter in operation["parameters"] if parameter["in"] == "query"]
    query = ", ".join(f"`{name}`" for name in names if name != "pretty")
    body = _reference(operation.get("requestBody", {}).get("content", {}))
    return "".join([f" with {body}" if body else "", f"; query {query}" if query else ""])


def _reply(operation: Mapping[str, Any]) -> str:
    return _reference(operation["responses"]["200"].get("content", {})) or "text"


def _reference(content: Mapping[str, Any]) -> str:
    schema = content.get("application/json", {}).get("schema", {})
    name = re.sub(r".*/", "", (schema.get("items") or schema).get("$ref", ""))
    return f"{name}[]" if name and "items" in schema else name


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
