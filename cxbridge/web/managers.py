"""The managers of features, loggers and components; docs/ros2cx.md, docs/debugging.md."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

from cxbridge.executive.host.loggers import ABOVE
from cxbridge.web.endpoint import API_VERSION, ApiError, Call, Endpoint
from cxbridge.web.environments import named_service, of_environment, optional_text, service_of

if TYPE_CHECKING:
    from cxbridge.executive.manager import FeatureInfo
    from cxbridge.executive.service import EnvironmentService

_FEATURES: Final = "/cxbridge/features"
_COMPONENTS: Final = "/cxbridge/components"
_NO_FEATURE: Final = {404: "There is no such feature"}
_NO_COMPONENT: Final = {404: "There is no such component"}


# -- features


def _feature_model(info: FeatureInfo) -> dict[str, Any]:
    row = asdict(info) | {"environments": list(info.environments)}
    return {"kind": "Feature", "apiVersion": API_VERSION, **row}


def _features(call: Call) -> list[dict[str, Any]]:
    return [_feature_model(info) for info in service_of(call).features()]


def _named_feature(call: Call) -> tuple[EnvironmentService, str]:
    """Return what manages features, and the name of the one that the path names.

    :raises ApiError: when there is none of that name, or no executive.
    """
    service, name = service_of(call), call.path["feature"]
    if all(info.name != name for info in service.features()):
        raise ApiError(404, f"Feature '{name}' is unknown")
    return service, name


def _feature(call: Call) -> dict[str, Any]:
    service, name = _named_feature(call)
    return _feature_model(service.feature(name))


def _offer(call: Call) -> dict[str, Any]:
    service, name = _named_feature(call)
    service.offer_feature(name)
    return _feature_model(service.feature(name))


def _withdraw(call: Call) -> dict[str, Any]:
    service, name = _named_feature(call)
    service.withdraw_feature(name)
    return _feature_model(service.feature(name))


# -- loggers


def _loggers(call: Call) -> list[dict[str, Any]]:
    service, name = named_service(call)
    return [{"kind": "Logger", "apiVersion": API_VERSION, **asdict(each)} for each in service.loggers(name)]


def _add_logger(call: Call) -> list[dict[str, Any]]:
    service, name = named_service(call)
    priority, replaces = call.body.get("priority", ABOVE), call.body.get("replaces", False)
    if not isinstance(priority, int) or isinstance(priority, bool):
        raise ApiError(400, "'priority' must be a whole number")
    if not isinstance(replaces, bool):
        raise ApiError(400, "'replaces' must be true or false")
    service.add_logger(
        name,
        call.text("name"),
        priority=priority,
        level=optional_text(call, "level") or "debug",
        contains=optional_text(call, "contains"),
        replaces=replaces,
        component=optional_text(call, "component"),
    )
    return _loggers(call)


def _remove_logger(call: Call) -> list[dict[str, Any]]:
    service, name = named_service(call)
    service.remove_logger(name, call.path["logger"])
    return _loggers(call)


# -- components


def _component_model(row: Any) -> dict[str, Any]:
    return {"kind": "ComponentInfo", "apiVersion": API_VERSION, **row}


def _components(call: Call) -> list[dict[str, Any]]:
    return [_component_model(row) for row in call.host.components()]


def _component(call: Call) -> dict[str, Any]:
    for row in call.host.components():
        if row["name"] == call.path["component"]:
            return _component_model(row)
    raise ApiError(404, f"Component '{call.path['component']}' is unknown")


def _change(call: Call) -> dict[str, Any]:
    _component(call)
    call.host.change_component(call.path["component"], call.text("transition"))
    return _component(call)


def _endpoint(method: str, path: str, handler: Any, about: str, **more: Any) -> Endpoint:
    return Endpoint(method=method, path=path, handler=handler, about=about, changes=method != "GET", **more)


ENDPOINTS: Final = (
    _endpoint("GET", _FEATURES, _features, "All features of CLIPS, by name.", reply="Feature", many=True),
    _endpoint(
        "GET",
        f"{_FEATURES}/{{feature}}",
        _feature,
        "One feature: it can be withdrawn while no environment has it.",
        reply="Feature",
        errors=_NO_FEATURE,
    ),
    _endpoint(
        "PUT",
        f"{_FEATURES}/{{feature}}",
        _offer,
        "Offer a feature to environments again.",
        reply="Feature",
        errors=_NO_FEATURE,
    ),
    _endpoint(
        "DELETE",
        f"{_FEATURES}/{{feature}}",
        _withdraw,
        "Offer a feature no more.",
        reply="Feature",
        errors={400: "An environment has it", **_NO_FEATURE},
    ),
    of_environment(
        "GET",
        "/{env}/loggers",
        _loggers,
        "The loggers of an environment, in the order in which they get a line.",
        reply="Logger",
        many=True,
    ),
    of_environment(
        "POST",
        "/{env}/loggers",
        _add_logger,
        "Give an environment another logger.",
        reply="Logger",
        many=True,
        body="NewLogger",
        errors={400: "There is one of that name, or it makes no sense"},
    ),
    of_environment(
        "DELETE",
        "/{env}/loggers/{logger}",
        _remove_logger,
        "Take a logger away.",
        reply="Logger",
        many=True,
        errors={400: "There is no such logger, or every environment has it"},
    ),
    _endpoint(
        "GET",
        _COMPONENTS,
        _components,
        "All components of the daemon, in the order of their start.",
        reply="ComponentInfo",
        many=True,
    ),
    _endpoint(
        "GET",
        f"{_COMPONENTS}/{{component}}",
        _component,
        "One component.",
        reply="ComponentInfo",
        errors=_NO_COMPONENT,
    ),
    _endpoint(
        "PUT",
        f"{_COMPONENTS}/{{component}}",
        _change,
        "Let a component take a step of its life.",
        reply="ComponentInfo",
        body="Transition",
        errors={400: "It is in no state for that, fails, or serves clients", **_NO_COMPONENT},
    ),
)
