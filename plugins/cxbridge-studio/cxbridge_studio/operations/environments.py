"""The operations on CLIPS environments: list, create, destroy, configure; see docs/debugging.md."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from msgspec import Meta, Struct, field

from cxbridge.daemon.operations.operation import (
    NoParameters,
    NotFoundError,
    OperationContext,
    Operations,
    Route,
    UnavailableError,
)
from cxbridge.errors import CxbridgeError
from cxbridge.rights import Right
from cxbridge_studio.debugger.environments import EnvironmentInfo, EnvironmentService
from cxbridge_studio.debugger.evaluating import Evaluation
from cxbridge_studio.debugger.levels import LevelName

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

OPERATIONS: Final = Operations()
PATH: Final = "/cxbridge/environments"

# The name of an environment that a client creates. The pattern describes it; EnvironmentService checks it.
NewEnvironmentName = Annotated[str, Meta(extra_json_schema={"pattern": "^[A-Za-z0-9_.-]{1,64}$"})]
_WatchedItem = Annotated[str, Meta(extra_json_schema={"enum": ["facts", "rules", "all"]})]


class NamedEnvironment(Struct):
    """Parameters with the name of an environment."""

    env: str


def find_environment(context: OperationContext, name: str) -> ClipsEnvironment:
    """Return the environment with a name.

    :raises CxbridgeError: if the executive is not running, or there is no such environment.
    """
    return context.executive.manager.find(name)


def list_environment_names(context: OperationContext) -> Sequence[str]:
    """Return the names of the environments, empty if the executive is not running."""
    try:
        return tuple(context.executive.manager.environments)
    except UnavailableError:
        return ()


# the name of the class is the member `kind` of the reply over HTTP
class Loaded(Struct):
    """The result of loading a file: the mistakes in the file."""

    diagnostics: list[str]


class _NewEnvironment(Struct):
    env: NewEnvironmentName


class _FileToLoad(NamedEnvironment):
    file: str
    batch: bool = False


class _EnvironmentFeature(NamedEnvironment):
    feature: str


class _WatchSetting(NamedEnvironment):
    item: _WatchedItem
    names: list[str] = field(default_factory=list)
    on: bool = True


class _LogLevelSetting(NamedEnvironment):
    level: LevelName


class _Expression(NamedEnvironment):
    expression: str


def make_service(context: OperationContext) -> EnvironmentService:
    """Return the service that manages the environments.

    :raises UnavailableError: if the executive is not running.
    """
    return EnvironmentService(context.executive.manager)


def check_environment(context: OperationContext, path: Mapping[str, str]) -> None:
    """Check the name of the environment in a path.

    :raises NotFoundError: if the environment does not exist.
    """
    if path["env"] not in list_environment_names(context):
        raise NotFoundError(f"Environment '{path['env']}' is unknown")


def make_environment_route(
    method: str, path: str, summary: str, reply: Any = EnvironmentInfo, errors: Any = None, **settings: Any
) -> Route[Any]:
    """Return a route below the path of an environment.

    :param errors: the descriptions of error replies by status, besides 404.
    """
    errors = {404: "There is no such environment", **(errors or {})}
    path = f"{PATH}/{{env}}{path}"
    return Route(method, path, summary, reply, check=check_environment, errors=errors, **settings)


def _describe_environment(context: OperationContext, parameters: Any) -> EnvironmentInfo:
    return make_service(context).describe(parameters.env)


OPERATIONS.add(
    "env-info",
    Right.LOOK,
    NamedEnvironment,
    make_environment_route("GET", "", "Return an environment."),
    is_verb=False,
)(_describe_environment)


@OPERATIONS.add(
    "env-list",
    Right.LOOK,
    NoParameters,
    Route("GET", PATH, "Return all environments, in the order of their creation.", list[EnvironmentInfo]),
)
def _list_environments(context: OperationContext, _parameters: NoParameters) -> Sequence[EnvironmentInfo]:
    return make_service(context).list()


@OPERATIONS.add(
    "env-create",
    Right.CONTROL,
    _NewEnvironment,
    Route(
        "POST",
        PATH,
        "Create an environment; its rules run in each loop, after the executive's.",
        EnvironmentInfo,
        answer=_describe_environment,
        body="EnvironmentName",
        names={"env": "name"},
        errors={400: "An environment has this name, or the name is invalid"},
    ),
)
def _create_environment(context: OperationContext, parameters: _NewEnvironment) -> None:
    make_service(context).create(parameters.env)


def _destroy_and_return_environment(
    context: OperationContext, parameters: NamedEnvironment
) -> EnvironmentInfo:
    # before the destruction, after which the environment cannot be described
    environment = _describe_environment(context, parameters)
    _destroy_environment(context, parameters)
    return environment


@OPERATIONS.add(
    "env-destroy",
    Right.CONTROL,
    NamedEnvironment,
    make_environment_route(
        "DELETE",
        "",
        "Destroy an environment that a client created.",
        errors={400: "The environment is the executive's"},
        http_function=_destroy_and_return_environment,
    ),
)
def _destroy_environment(context: OperationContext, parameters: NamedEnvironment) -> None:
    make_service(context).destroy(parameters.env)


def _load_absolute_path(context: OperationContext, parameters: _FileToLoad) -> Loaded:
    # An HTTP client does not know the daemon's working directory.
    if not Path(parameters.file).is_absolute():
        raise CxbridgeError("The file must be an absolute path of the daemon's machine")
    return Loaded(list(_load_file(context, parameters)))


@OPERATIONS.add(
    "env-load",
    Right.PROGRAMS,
    _FileToLoad,
    make_environment_route(
        "POST",
        "/load",
        "Load a CLIPS file of the daemon's machine, and return the mistakes in the file.",
        Loaded,
        {400: "CLIPS cannot read the file"},
        http_function=_load_absolute_path,
        body="EnvironmentFile",
    ),
)
def _load_file(context: OperationContext, parameters: _FileToLoad) -> Sequence[str]:
    return make_service(context).load(parameters.env, Path(parameters.file), batch=parameters.batch)


@OPERATIONS.add(
    "env-feature",
    Right.CONTROL,
    _EnvironmentFeature,
    make_environment_route(
        "POST",
        "/features",
        "Add a feature to an environment.",
        errors={400: "There is no such feature"},
        answer=_describe_environment,
        body="FeatureName",
    ),
)
def _request_feature(context: OperationContext, parameters: _EnvironmentFeature) -> None:
    make_service(context).request_feature(parameters.env, parameters.feature)


@OPERATIONS.add(
    "env-watch",
    Right.CONTROL,
    _WatchSetting,
    make_environment_route(
        "PUT",
        "/watch",
        "Watch facts or rules, so that they are recorded.",
        answer=_describe_environment,
        body="Watch",
    ),
)
def _set_watch(context: OperationContext, parameters: _WatchSetting) -> None:
    make_service(context).watch(parameters.env, parameters.item, parameters.names, on=parameters.on)


@OPERATIONS.add(
    "env-log",
    Right.CONTROL,
    _LogLevelSetting,
    make_environment_route(
        "PUT",
        "/log",
        "Set the lowest level of the lines that an environment logs.",
        answer=_describe_environment,
        body="LogLevel",
    ),
)
def _set_log_level(context: OperationContext, parameters: _LogLevelSetting) -> None:
    make_service(context).set_log_level(parameters.env, parameters.level)


def _evaluate_checked_text(context: OperationContext, parameters: _Expression) -> object:
    if "\0" in parameters.expression:  # CLIPS would evaluate the text before the zero byte
        raise CxbridgeError("A text of CLIPS cannot contain a zero byte")
    return _evaluate_expression(context, parameters)


@OPERATIONS.add(
    "env-eval",
    Right.PROGRAMS,
    _Expression,
    make_environment_route(
        "POST",
        "/eval",
        "Evaluate a CLIPS expression.",
        Evaluation,
        {400: "The expression does not parse, fails, or takes too long"},
        kind="Value",
        http_function=_evaluate_checked_text,
        body="Expression",
    ),
)
def _evaluate_expression(context: OperationContext, parameters: _Expression) -> Evaluation:
    return make_service(context).evaluate(parameters.env, parameters.expression)
