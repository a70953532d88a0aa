"""CLIPS environments beside the executive's: made, set up, asked and destroyed; docs/debugging.md."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cxbridge.web.endpoint import API_VERSION, ApiError, Call, Endpoint, Handler
from cxbridge.web.fawkes.slots import environment

if TYPE_CHECKING:
    from cxbridge.executive.service import EnvironmentInfo, EnvironmentService

_PATH: Final = "/cxbridge/environments"


def service_of(call: Call) -> EnvironmentService:
    """Return what manages environments.

    :raises ApiError: when there is no executive.
    """
    found = call.host.environment_service
    if found is None:
        raise ApiError(503, "The executive is not there now")
    return found


def named_service(call: Call) -> tuple[EnvironmentService, str]:
    """Return what manages environments, and the name of the one that the path names.

    :raises ApiError: when there is none of that name, or no executive.
    """
    service = service_of(call)
    environment(call, call.path["env"], 404)
    return service, call.path["env"]


def optional_text(call: Call, name: str) -> str:
    """Return a member of the body that may be there; empty when it is not.

    :raises ApiError: when it is no text.
    """
    value = call.body.get(name, "")
    if not isinstance(value, str):
        raise ApiError(400, f"'{name}' must be a text")
    return value


def _model(info: EnvironmentInfo) -> dict[str, Any]:
    return {"kind": "EnvironmentInfo", "apiVersion": API_VERSION, **asdict(info)}


def _list(call: Call) -> list[dict[str, Any]]:
    return [_model(info) for info in service_of(call).list()]


def _look(call: Call) -> dict[str, Any]:
    service, name = named_service(call)
    return _model(service.info(name))


def _create(call: Call) -> dict[str, Any]:
    service, name = service_of(call), call.text("name")
    service.create(name, optional_text(call, "log"))
    return _model(service.info(name))


def _destroy(call: Call) -> dict[str, Any]:
    model = _look(call)
    service_of(call).destroy(call.path["env"])
    return model


def _load(call: Call) -> dict[str, Any]:
    service, name = named_service(call)
    file, batch = Path(call.text("file")), call.body.get("batch", False)
    if not isinstance(batch, bool):
        raise ApiError(400, "'batch' must be true or false")
    if not file.is_absolute():
        raise ApiError(400, "The file must be an absolute path of the daemon's machine")
    found = service.load(name, file, batch=batch)
    return {"kind": "Loaded", "apiVersion": API_VERSION, "diagnostics": list(found)}


def _request(call: Call) -> dict[str, Any]:
    service, name = named_service(call)
    service.request_feature(name, call.text("feature"))
    return _model(service.info(name))


def _remove(call: Call) -> dict[str, Any]:
    service, name = named_service(call)
    service.remove_feature(name, call.path["feature"])
    return _model(service.info(name))


def _watch(call: Call) -> dict[str, Any]:
    service, name = named_service(call)
    names, on = call.body.get("names", []), call.body.get("on", True)
    if not isinstance(names, list) or not all(isinstance(item, str) for item in names):
        raise ApiError(400, "'names' must be a list of texts")
    if not isinstance(on, bool):
        raise ApiError(400, "'on' must be true or false")
    service.watch(name, call.text("item"), names, on=on)
    return _model(service.info(name))


def _log(call: Call) -> dict[str, Any]:
    service, name = named_service(call)
    service.set_log_level(name, call.text("level"))
    return _model(service.info(name))


def _eval(call: Call) -> dict[str, Any]:
    service, name = named_service(call)
    expression = call.text("expression")
    if "\0" in expression:
        raise ApiError(400, "CLIPS has no such text")
    found = service.evaluate(name, expression)
    return {"kind": "Value", "apiVersion": API_VERSION, "text": found.text, "output": list(found.output)}


def of_environment(method: str, path: str, handler: Handler, about: str, **more: Any) -> Endpoint:
    """Describe an endpoint of an environment.

    :param path: below that of the environments.
    :param more: see :class:`Endpoint`; the reply is an EnvironmentInfo by default.
    """
    reply = more.pop("reply", "EnvironmentInfo")
    if "/{env}" in path:
        more["errors"] = {404: "There is no such environment", **more.get("errors", {})}
    return Endpoint(
        method=method,
        path=f"{_PATH}{path}",
        handler=handler,
        about=about,
        reply=reply,
        changes=method != "GET",
        **more,
    )


ENDPOINTS: Final = (
    of_environment("GET", "", _list, "All environments, in the order in which they were created.", many=True),
    of_environment(
        "POST",
        "",
        _create,
        "Create an environment; its rules run in each loop, after the executive's.",
        body="EnvironmentName",
        errors={400: "There is one of that name, or none can have it"},
    ),
    of_environment("GET", "/{env}", _look, "One environment."),
    of_environment(
        "DELETE",
        "/{env}",
        _destroy,
        "Destroy an environment that was created so.",
        errors={400: "It is the executive's"},
    ),
    of_environment(
        "POST",
        "/{env}/load",
        _load,
        "Load a file of the daemon's machine; tells what is wrong with it.",
        reply="Loaded",
        body="EnvironmentFile",
        errors={400: "CLIPS cannot read the file"},
    ),
    of_environment(
        "POST",
        "/{env}/features",
        _request,
        "Give an environment a feature.",
        body="FeatureName",
        errors={400: "There is no such feature"},
    ),
    of_environment(
        "DELETE",
        "/{env}/features/{feature}",
        _remove,
        "Take a feature away from an environment: calls of its functions fail until it is given again.",
        errors={400: "The environment does not have it"},
    ),
    of_environment(
        "PUT", "/{env}/watch", _watch, "Watch facts or rules: what is watched is recorded.", body="Watch"
    ),
    of_environment(
        "PUT", "/{env}/log", _log, "Let it log only lines of this level and above.", body="LogLevel"
    ),
    of_environment(
        "POST",
        "/{env}/eval",
        _eval,
        "Evaluate an expression of CLIPS.",
        reply="Value",
        body="Expression",
        errors={400: "It does not parse, fails, or takes too long"},
    ),
)
