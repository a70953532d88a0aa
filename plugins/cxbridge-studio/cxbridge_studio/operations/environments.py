"""The operations on CLIPS environments besides the executive's; docs/debugging.md."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final

from msgspec import Meta, Struct, field

from cxbridge.daemon.operations.operation import (
    NamedEnvironment,
    NoParameters,
    NotFoundError,
    OperationContext,
    Operations,
    Route,
    environment_names,
)
from cxbridge.errors import CxbridgeError
from cxbridge.executive.host.loggers import LevelName
from cxbridge.rights import Right
from cxbridge_studio.debugger.environments import EnvironmentInfo, EnvironmentService
from cxbridge_studio.debugger.evaluating import Evaluation

OPERATIONS: Final = Operations()
PATH: Final = "/cxbridge/environments"

Name = Annotated[str, Meta(extra_json_schema={"pattern": "^[A-Za-z0-9_.-]{1,64}$"})]
_Item = Annotated[str, Meta(extra_json_schema={"enum": ["facts", "rules", "all"]})]


class Loaded(Struct):
    """The mistakes in a loaded file."""

    diagnostics: list[str]


class _NewEnvironment(Struct):
    env: Name
    log: str = ""


class _File(NamedEnvironment):
    file: str
    batch: bool = False


class _EnvironmentFeature(NamedEnvironment):
    feature: str


class _Watch(NamedEnvironment):
    item: _Item
    names: list[str] = field(default_factory=list)
    on: bool = True


class _Level(NamedEnvironment):
    level: LevelName


class _Expression(NamedEnvironment):
    expression: str


def service_of(context: OperationContext) -> EnvironmentService:
    """Return the service that manages the environments.

    :raises UnavailableError: if the executive is not running.
    """
    return EnvironmentService(context.executive.manager)


def check_environment(context: OperationContext, path: Mapping[str, str]) -> None:
    """Check the environment of a path.

    :raises NotFoundError: if the environment does not exist.
    """
    if path["env"] not in environment_names(context):
        raise NotFoundError(f"Environment '{path['env']}' is unknown")


def of_environment(
    method: str, path: str, summary: str, reply: Any = EnvironmentInfo, errors: Any = None, **settings: Any
) -> Route[Any]:
    """Return the route of an environment's property."""
    errors = {404: "There is no such environment", **(errors or {})}
    path = f"{PATH}/{{env}}{path}"
    return Route(method, path, summary, reply, check=check_environment, errors=errors, **settings)


def _info(context: OperationContext, parameters: Any) -> EnvironmentInfo:
    return service_of(context).info(parameters.env)


OPERATIONS.add(
    "env-info",
    Right.LOOK,
    NamedEnvironment,
    of_environment("GET", "", "Return an environment."),
    is_verb=False,
)(_info)


@OPERATIONS.add(
    "env-list",
    Right.LOOK,
    NoParameters,
    Route("GET", PATH, "Return all environments, in the order of their creation.", list[EnvironmentInfo]),
)
def _list(context: OperationContext, _parameters: NoParameters) -> Sequence[EnvironmentInfo]:
    return service_of(context).list()


@OPERATIONS.add(
    "env-create",
    Right.CONTROL,
    _NewEnvironment,
    Route(
        "POST",
        PATH,
        "Create an environment; its rules run in each loop, after the executive's.",
        EnvironmentInfo,
        answer=_info,
        body="EnvironmentName",
        names={"env": "name"},
        errors={400: "An environment has this name, or the name is invalid"},
    ),
)
def _create(context: OperationContext, parameters: _NewEnvironment) -> None:
    service_of(context).create(parameters.env, parameters.log)


def _destroy_and_describe(context: OperationContext, parameters: NamedEnvironment) -> EnvironmentInfo:
    info = _info(context, parameters)  # before the environment is destroyed
    _destroy(context, parameters)
    return info


@OPERATIONS.add(
    "env-destroy",
    Right.CONTROL,
    NamedEnvironment,
    of_environment(
        "DELETE",
        "",
        "Destroy an environment that a client created.",
        errors={400: "The environment is the executive's"},
        http_function=_destroy_and_describe,
    ),
)
def _destroy(context: OperationContext, parameters: NamedEnvironment) -> None:
    service_of(context).destroy(parameters.env)


def _load_absolute(context: OperationContext, parameters: _File) -> Loaded:
    # An HTTP client does not know the daemon's working directory.
    if not Path(parameters.file).is_absolute():
        raise CxbridgeError("The file must be an absolute path of the daemon's machine")
    return Loaded(list(_load(context, parameters)))


@OPERATIONS.add(
    "env-load",
    Right.PROGRAMS,
    _File,
    of_environment(
        "POST",
        "/load",
        "Load a CLIPS file of the daemon's machine, and return the mistakes in the file.",
        Loaded,
        {400: "CLIPS cannot read the file"},
        http_function=_load_absolute,
        body="EnvironmentFile",
    ),
)
def _load(context: OperationContext, parameters: _File) -> Sequence[str]:
    return service_of(context).load(parameters.env, Path(parameters.file), batch=parameters.batch)


@OPERATIONS.add(
    "env-feature",
    Right.CONTROL,
    _EnvironmentFeature,
    of_environment(
        "POST",
        "/features",
        "Add a feature to an environment.",
        errors={400: "There is no such feature"},
        answer=_info,
        body="FeatureName",
    ),
)
def _request_feature(context: OperationContext, parameters: _EnvironmentFeature) -> None:
    service_of(context).request_feature(parameters.env, parameters.feature)


@OPERATIONS.add(
    "env-feature-remove",
    Right.CONTROL,
    _EnvironmentFeature,
    of_environment(
        "DELETE",
        "/features/{feature}",
        "Remove a feature from an environment: calls of its functions fail until it is added again.",
        errors={400: "The environment does not have the feature"},
        answer=_info,
    ),
)
def _remove_feature(context: OperationContext, parameters: _EnvironmentFeature) -> None:
    service_of(context).remove_feature(parameters.env, parameters.feature)


@OPERATIONS.add(
    "env-watch",
    Right.CONTROL,
    _Watch,
    of_environment(
        "PUT", "/watch", "Watch facts or rules, so that they are recorded.", answer=_info, body="Watch"
    ),
)
def _watch(context: OperationContext, parameters: _Watch) -> None:
    service_of(context).watch(parameters.env, parameters.item, parameters.names, on=parameters.on)


@OPERATIONS.add(
    "env-log",
    Right.CONTROL,
    _Level,
    of_environment(
        "PUT",
        "/log",
        "Set the lowest level of the lines that an environment logs.",
        answer=_info,
        body="LogLevel",
    ),
)
def _log(context: OperationContext, parameters: _Level) -> None:
    service_of(context).set_log_level(parameters.env, parameters.level)


def _evaluate_text(context: OperationContext, parameters: _Expression) -> object:
    if "\0" in parameters.expression:  # CLIPS' strings end at the first zero byte
        raise CxbridgeError("CLIPS has no such text")
    return _evaluate(context, parameters)


@OPERATIONS.add(
    "env-eval",
    Right.PROGRAMS,
    _Expression,
    of_environment(
        "POST",
        "/eval",
        "Evaluate a CLIPS expression.",
        Evaluation,
        {400: "The expression does not parse, fails, or takes too long"},
        kind="Value",
        http_function=_evaluate_text,
        body="Expression",
    ),
)
def _evaluate(context: OperationContext, parameters: _Expression) -> Evaluation:
    return service_of(context).evaluate(parameters.env, parameters.expression)
