"""Operations on the components of a daemon: states, and transitions of their lifecycle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Annotated, Any, Final

from msgspec import Meta, Struct

from cxbridge.daemon.operations.operation import (
    NoParameters,
    NotFoundError,
    OperationContext,
    Operations,
    Route,
)
from cxbridge.daemon.operations.replies import ComponentState
from cxbridge.rights import Right

OPERATIONS: Final = Operations()
_PATH: Final = "/cxbridge/components"
_ROW_KIND: Final = "ComponentInfo"  # the member `kind` of each reply
_UNKNOWN_COMPONENT: Final = {404: "No component has this name"}
_TRANSITIONS: Final = ["configure", "activate", "deactivate", "cleanup", "shutdown"]


class _ComponentParameters(Struct):
    component: str


class _TransitionParameters(_ComponentParameters):
    transition: Annotated[str, Meta(extra_json_schema={"enum": _TRANSITIONS})]


def _find_component(context: OperationContext, name: str) -> Mapping[str, Any]:
    for row in context.component_rows():
        if row["name"] == name:
            return row
    raise NotFoundError(f"Component '{name}' is unknown")


def _make_route(
    method: str, summary: str, *, errors: Mapping[int, str] = MappingProxyType({}), body: str = ""
) -> Route[Any]:
    """Return a route for one component. Its reply is the state of the component after the operation."""
    return Route(
        method,
        f"{_PATH}/{{component}}",
        summary,
        ComponentState,
        _ROW_KIND,
        answer=_describe_component,
        check=lambda context, path_values: _find_component(context, path_values["component"]),
        body=body,
        errors={**_UNKNOWN_COMPONENT, **errors},
    )


def _describe_component(context: OperationContext, parameters: Any) -> Mapping[str, Any]:
    return _find_component(context, parameters.component)


# no verb: the command line reads a component from component-list
OPERATIONS.add(
    "component-info",
    Right.LOOK,
    _ComponentParameters,
    _make_route("GET", "Return a component."),
    is_verb=False,
)(_describe_component)


@OPERATIONS.add(
    "component-list",
    Right.LOOK,
    NoParameters,
    Route("GET", _PATH, "List the components in the order of their start.", list[ComponentState], _ROW_KIND),
)
def _list_components(context: OperationContext, _parameters: NoParameters) -> Sequence[Mapping[str, Any]]:
    return context.component_rows()


@OPERATIONS.add(
    "component-change",
    Right.CONTROL,
    _TransitionParameters,
    _make_route(
        "PUT",
        "Change the state of a component by a transition of its lifecycle.",
        body="Transition",
        errors={
            400: "The state of the component does not allow the transition, the transition fails, or "
            "clients cannot stop the component"
        },
    ),
)
def _change_component(context: OperationContext, parameters: _TransitionParameters) -> None:
    context.change_component(parameters.component, parameters.transition)
