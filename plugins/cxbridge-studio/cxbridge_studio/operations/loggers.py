"""The operations on the loggers of CLIPS environments; see docs/debugging.md."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Final

from msgspec import Meta
from msgspec.structs import asdict

from cxbridge.daemon.operations.operation import OperationContext, Operations
from cxbridge.executive.host.loggers import ADDED_LOGGER_PRIORITY
from cxbridge.rights import Right
from cxbridge_studio.debugger.environments import LoggerInfo
from cxbridge_studio.debugger.levels import LevelName
from cxbridge_studio.operations.environments import (
    Identifier,
    NamedEnvironment,
    make_environment_route,
    make_service,
)

OPERATIONS: Final = Operations()


class _Logger(NamedEnvironment):
    logger: str


class _NewLogger(NamedEnvironment):
    logger: Identifier
    priority: Annotated[int, Meta(extra_json_schema={"minimum": -2000, "maximum": 2000})] = (
        ADDED_LOGGER_PRIORITY
    )
    level: LevelName = "debug"
    contains: str = ""
    replaces: bool = False
    component: str = ""


@OPERATIONS.add(
    "env-loggers",
    Right.LOOK,
    NamedEnvironment,
    make_environment_route(
        "GET",
        "/loggers",
        "Return the loggers of an environment, in the order in which they get a line.",
        list[LoggerInfo],
        kind="Logger",
    ),
)
def _list_loggers(context: OperationContext, parameters: Any) -> Sequence[LoggerInfo]:
    return make_service(context).loggers(parameters.env)


@OPERATIONS.add(
    "env-logger-add",
    Right.CONTROL,
    _NewLogger,
    make_environment_route(
        "POST",
        "/loggers",
        "Add a logger to an environment.",
        list[LoggerInfo],
        {400: "The environment has a logger with this name, or a setting is invalid"},
        kind="Logger",
        answer=_list_loggers,
        body="NewLogger",
        names={"logger": "name"},
    ),
)
def _add_logger(context: OperationContext, parameters: _NewLogger) -> None:
    # An empty level stands for the default, as an omitted level does.
    parameters.level = parameters.level or "debug"
    settings = asdict(parameters)
    make_service(context).add_logger(settings.pop("env"), settings.pop("logger"), **settings)


@OPERATIONS.add(
    "env-logger-remove",
    Right.CONTROL,
    _Logger,
    make_environment_route(
        "DELETE",
        "/loggers/{logger}",
        "Remove a logger from an environment.",
        list[LoggerInfo],
        {400: "There is no such logger, or the logger belongs to every environment"},
        kind="Logger",
        answer=_list_loggers,
    ),
)
def _remove_logger(context: OperationContext, parameters: _Logger) -> None:
    make_service(context).remove_logger(parameters.env, parameters.logger)
