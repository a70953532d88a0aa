"""The description of the API: an OpenAPI document, made of its endpoints."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Final

from cxbridge import __version__
from cxbridge_web.endpoint import Endpoint
from cxbridge_web.models import INTEGER, SCHEMAS, STRING
from cxbridge_web.operations import body_schemas
from cxbridge_web.paging import PARAMETERS

EVENTS_PATH: Final = "/cxbridge/events"
PATH: Final = "/openapi.json"

_NAME: Final = re.compile(r"\{([a-z_-]+)\+?\}")
_ALWAYS: Final = {
    400: "The request makes no sense",
    401: "A token is needed",
    403: "Pages of other origins, or of clients at all, may not do this",
    404: "There is no such thing",
    503: "It cannot be answered now",
}
_BODY: Final = {413: "The body is too long"}


def document(endpoints: Sequence[Endpoint]) -> dict[str, Any]:
    """Return the document."""
    paths: dict[str, Any] = {}
    for endpoint in endpoints:
        path = _NAME.sub(r"{\1}", endpoint.path.removesuffix("/?"))
        paths.setdefault(path, {})[endpoint.method.lower()] = _operation(endpoint)
    paths[EVENTS_PATH] = {"get": _events()}
    return {
        "openapi": "3.0.3",
        "info": {
            "title": "cxbridge",
            "version": __version__,
            "description": "Fawkes' REST API, and cxbridge's own; see docs/rest.md.",
        },
        "servers": [{"url": "/api"}],
        "paths": paths,
        "components": {
            "schemas": SCHEMAS | body_schemas(),
            "securitySchemes": {
                "bearer": {"type": "http", "scheme": "bearer"},
                "basic": {"type": "http", "scheme": "basic"},
            },
        },
        "security": [{}, {"bearer": []}, {"basic": []}],
    }


def _operation(endpoint: Endpoint) -> dict[str, Any]:
    ok: dict[str, Any] = {"description": endpoint.about}
    if endpoint.reply:
        schema: dict[str, Any] = {"$ref": f"#/components/schemas/{endpoint.reply}"}
        if endpoint.many:
            schema = {"type": "array", "items": schema}
        ok["content"] = {"application/json": {"schema": schema}}
    else:
        ok["content"] = {"text/plain": {"schema": STRING}}
    if endpoint.paged:
        ok["headers"] = {"X-Total-Count": {"description": "How many there are in all.", "schema": INTEGER}}
    errors = {**_ALWAYS, **(_BODY if endpoint.body else {}), **endpoint.errors}
    operation: dict[str, Any] = {
        "tags": [endpoint.component],
        "summary": endpoint.about,
        "operationId": _operation_id(endpoint),
        "parameters": [
            *(_in_path(name) for name in _NAME.findall(endpoint.path)),
            *(_in_query(query.name, query.about, dict(query.schema)) for query in endpoint.query),
            *(_in_query(name, about, dict(schema)) for name, about, schema in PARAMETERS if endpoint.paged),
            _in_query("pretty", "Laid out for people.", {"type": "boolean"}),
        ],
        "responses": {
            "200": ok,
            **{str(status): {"description": text} for status, text in sorted(errors.items())},
        },
    }
    if endpoint.body:
        schema = {"$ref": f"#/components/schemas/{endpoint.body}"}
        operation["requestBody"] = {"required": True, "content": {"application/json": {"schema": schema}}}
    return operation


def _operation_id(endpoint: Endpoint) -> str:
    words = re.findall(r"[A-Za-z]+", endpoint.path)
    return "_".join([endpoint.method.lower(), *words])


def _in_path(name: str) -> dict[str, Any]:
    schema = INTEGER if name in ("index", "number") else {**STRING, "minLength": 1}
    return {"name": name, "in": "path", "required": True, "schema": schema}


def _in_query(name: str, about: str, schema: dict[str, Any]) -> dict[str, Any]:
    return {"name": name, "in": "query", "description": about, "schema": schema}


def _events() -> dict[str, Any]:
    return {
        "tags": ["cxbridge"],
        "summary": "Events as they happen: server-sent events, each a JSON object with its kind.",
        "operationId": "get_cxbridge_events",
        "parameters": [
            _in_query("kinds", "Which, with commas between.", dict(STRING)),
            _in_query("env", "Of which CLIPS environment.", dict(STRING)),
            _in_query("since", "Go on after the event of this id; 0: all that is kept.", dict(STRING)),
        ],
        "responses": {
            "200": {"description": "A stream", "content": {"text/event-stream": {"schema": STRING}}},
            "400": {"description": "There is no such kind or event"},
            "503": {"description": "Too many follow already"},
        },
    }
