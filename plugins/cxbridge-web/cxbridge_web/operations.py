"""Endpoints and models for the routes of :mod:`cxbridge.daemon.operations`.

The types of an operation's parameters and answer are structs, so an endpoint is generated from them: the
checks of the request, its error texts, and the models of the OpenAPI document.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, get_args, get_origin

import msgspec
from msgspec import NODEFAULT
from msgspec.structs import FieldInfo, fields

from cxbridge.daemon.operations.operation import (
    NotFoundError,
    Operation,
    ParameterError,
    Route,
    UnavailableError,
    to_json,
)
from cxbridge.daemon.operations.table import operations
from cxbridge.numbers import parse_decimal
from cxbridge_web.endpoint import ApiCall, ApiError, Endpoint, QueryParameter
from cxbridge_web.models import API_VERSION, make_model

_TYPE_NAMES: Final = {str: "a text", bool: "true or false", int: "a whole number", list: "a list of texts"}


def make_endpoints() -> Iterator[Endpoint]:
    """Yield an endpoint for each route of an operation."""
    for operation in operations().values():
        for route in operation.routes:
            yield _make_endpoint(operation, route)


def _make_endpoint(operation: Operation[Any], route: Route[Any]) -> Endpoint:
    is_list = get_origin(route.reply) is list
    answer_type = get_args(route.reply)[0] if is_list else route.reply
    kind = route.kind or answer_type.__name__
    # the answer has JSON values already, so the handler adds the members of its model
    common_members, model = {"kind": kind, "apiVersion": API_VERSION}, make_model(kind, answer_type)

    def handler(call: ApiCall) -> Any:
        context = call.host.operations
        try:
            if route.check is not None:
                route.check(context, call.path_values)
            arguments = operation.parse(_read_arguments(operation, route, call), strict=True)
            result = (route.http_function or operation.carry_out)(context, arguments)
            if route.answer is not None:
                result = route.answer(context, arguments)
        except ParameterError as error:
            raise ApiError(400, _make_error_text(operation, route, error.name)) from error
        except UnavailableError as error:
            raise ApiError(503, "The executive is not running now") from error
        except NotFoundError as error:
            raise ApiError(error.status, error.message) from error
        answer = to_json(result)
        return [common_members | item for item in answer] if is_list else common_members | answer

    return Endpoint(
        method=route.method,
        path=route.path,
        handler=handler,
        summary=route.summary,
        reply=list[model] if is_list else model,  # type: ignore[valid-type]  # a type that is made at run time
        path_types={
            field.name: int for field in fields(operation.parameters) if _find_bare_type(field) is int
        },
        query=tuple(QueryParameter(name, description) for name, description in route.query.items()),
        body=_make_body_type(operation.parameters, route) if route.body else None,
        errors=route.errors,
        right=operation.right,
    )


def _read_arguments(operation: Operation[Any], route: Route[Any], call: ApiCall) -> dict[str, Any]:
    """Return the parameters of a request from its path, query and body.

    :raises ParameterError: if a required text is missing or empty.
    """
    arguments: dict[str, Any] = {}
    for parameter in fields(operation.parameters):
        name = parameter.name
        member = route.names.get(name, name)
        if name in call.path_values:
            is_number = _find_bare_type(parameter) is int
            # None for a text that is not a number; then `operation.parse` reports a wrong value
            arguments[name] = parse_decimal(call.path_values[name]) if is_number else call.path_values[name]
        elif name in route.defaults:
            arguments[name] = call.query.get(name) or call.body.get(member) or route.defaults[name]
        elif member in call.body:
            arguments[name] = call.body[member]
        # A form sends an empty text for an empty field, which msgspec would accept as a text.
        if parameter.required and _find_bare_type(parameter) is str and not arguments.get(name):
            raise ParameterError(name, "it must not be empty")
    return arguments


def _make_error_text(operation: Operation[Any], route: Route[Any], name: str) -> str:
    """Return the error text for a wrong parameter."""
    parameter = {field.name: field for field in fields(operation.parameters)}[name]
    member, bare_type = route.names.get(name, name), _find_bare_type(parameter)
    if parameter.required and bare_type is str and name not in route.defaults:
        return f"The body lacks '{member}', which must be a text"
    expected_type = _TYPE_NAMES.get(bare_type) or _get_metadata(parameter).description
    return f"'{member}' must be {expected_type}"


def _get_metadata(parameter: FieldInfo) -> msgspec.Meta:
    """Return the annotation of a parameter's type; an empty one for a type without annotation."""
    metadata: tuple[msgspec.Meta, ...] = getattr(parameter.type, "__metadata__", (msgspec.Meta(),))
    return metadata[0]


def _find_bare_type(parameter: FieldInfo) -> Any:
    """Return the type of a parameter, without its metadata and without the types of its items."""
    # `__metadata__` marks an Annotated type, whose first argument is the type itself
    bare_type = get_args(parameter.type)[0] if hasattr(parameter.type, "__metadata__") else parameter.type
    return get_origin(bare_type) or bare_type


def _make_body_type(parameters: type[msgspec.Struct], route: Route[Any]) -> type[msgspec.Struct]:
    """Return the type of a route's body: the parameters outside of path and query."""
    members: list[Any] = []
    for field in fields(parameters):
        if f"{{{field.name}}}" not in route.path and field.name not in route.query:
            name_and_type = (route.names.get(field.name, field.name), field.type)
            default = route.defaults.get(field.name, field.default)
            members.append(name_and_type if default is NODEFAULT else (*name_and_type, default))
    return msgspec.defstruct(route.body, members, kw_only=True)
