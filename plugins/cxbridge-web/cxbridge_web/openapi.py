"""The OpenAPI document of the API, generated from its endpoints."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated, Any, Final

from msgspec import Meta

from cxbridge import __version__
from cxbridge_web.endpoint import Endpoint, QueryParameter
from cxbridge_web.models import make_schema, make_schemas

EVENTS_PATH: Final = "/cxbridge/events"
DOCUMENT_PATH: Final = "/openapi.json"

# A name in a path: `{x}`, or `{x+}` for a name that also matches slashes.
_PATH_NAME: Final = re.compile(r"\{([a-z_-]+)\+?\}")
_COMMON_ERRORS: Final = {
    400: "The request is invalid",
    401: "The request needs a token",
    403: "Pages of other origins, or clients in general, may not do this",
    404: "The requested object does not exist",
    503: "The request cannot be answered now",
}
_NonEmptyText = Annotated[str, Meta(min_length=1)]
_PRETTY: Final = QueryParameter("pretty", "Indent the JSON text for human readers.", bool)
_BODY_ERRORS: Final = {413: "The body is too long"}


def make_document(endpoints: Sequence[Endpoint]) -> dict[str, Any]:
    """Return the OpenAPI document."""
    paths: dict[str, Any] = {}
    for endpoint in endpoints:
        # OpenAPI has neither names that match slashes nor optional slashes, `/?`.
        path = _PATH_NAME.sub(r"{\1}", endpoint.path.removesuffix("/?"))
        paths.setdefault(path, {})[endpoint.method.lower()] = _describe_endpoint(endpoint)
    paths[EVENTS_PATH] = {"get": _describe_events_operation()}  # a stream, which no endpoint serves
    return {
        "openapi": "3.1.0",
        "info": {
            "title": "cxbridge",
            "version": __version__,
            "description": "Fawkes' REST API with extensions of cxbridge; see docs/rest.md.",
        },
        "servers": [{"url": "/api"}],
        "paths": paths,
        "components": {
            "schemas": make_schemas(
                [endpoint.reply for endpoint in endpoints],
                [endpoint.body for endpoint in endpoints if endpoint.body is not None],
            ),
            "securitySchemes": {
                "bearer": {"type": "http", "scheme": "bearer"},
                "basic": {"type": "http", "scheme": "basic"},
            },
        },
        # `{}`: no token, for a server without a token
        "security": [{}, {"bearer": []}, {"basic": []}],
    }


def _describe_endpoint(endpoint: Endpoint) -> dict[str, Any]:
    media_type = "text/plain" if endpoint.reply is str else "application/json"
    success = {"description": endpoint.summary, "content": _make_content(media_type, endpoint.reply)}
    errors = {**_COMMON_ERRORS, **(_BODY_ERRORS if endpoint.body else {}), **endpoint.errors}
    operation: dict[str, Any] = {
        "tags": [endpoint.component],
        "summary": endpoint.summary,
        "operationId": "_".join([endpoint.method.lower(), *re.findall(r"[A-Za-z]+", endpoint.path)]),
        "parameters": [
            *(
                {
                    "name": name,
                    "in": "path",
                    "required": True,
                    "schema": make_schema(endpoint.path_types.get(name, _NonEmptyText)),
                }
                for name in _PATH_NAME.findall(endpoint.path)
            ),
            *map(_describe_query_parameter, (*endpoint.query, _PRETTY)),
        ],
        "responses": {
            "200": success,
            **{str(status): {"description": text} for status, text in sorted(errors.items())},
        },
    }
    if endpoint.body is not None:
        operation["requestBody"] = {
            "required": True,
            "content": _make_content("application/json", endpoint.body),
        }
    return operation


def _make_content(media_type: str, value_type: Any) -> dict[str, Any]:
    return {media_type: {"schema": make_schema(value_type)}}


def _describe_query_parameter(parameter: QueryParameter) -> dict[str, Any]:
    return {
        "name": parameter.name,
        "in": "query",
        "description": parameter.description,
        "schema": make_schema(parameter.type),
    }


def _describe_events_operation() -> dict[str, Any]:
    return {
        "tags": ["cxbridge"],
        "summary": "The events of the run as server-sent events, each a JSON object with its kind.",
        "operationId": "get_cxbridge_events",
        "parameters": [
            _describe_query_parameter(QueryParameter("kinds", "The kinds of events, separated by commas.")),
            _describe_query_parameter(
                QueryParameter(
                    "since", "The id of the event after which to continue; 0 for all buffered events."
                )
            ),
        ],
        "responses": {
            "200": {"description": "A stream of events", "content": _make_content("text/event-stream", str)},
            "400": {"description": "A kind is unknown, or the id is invalid"},
            "503": {"description": "Too many clients are following the events already"},
        },
    }
