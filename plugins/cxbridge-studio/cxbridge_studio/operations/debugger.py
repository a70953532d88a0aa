"""The operations of the debugger on breakpoints, steps and the current stop; see docs/debugging.md.

An operation is a verb of RequestInterface, a route of the REST API, or both. The classes of parameters are
private: the field names are part of requests and routes, but not the class names.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Final

from msgspec import UNSET, Meta, Struct, UnsetType

from cxbridge.daemon.operations.operation import (
    NoParameters,
    OperationContext,
    Operations,
    Route,
)
from cxbridge.daemon.operations.replies import StopInfo
from cxbridge.daemon.operations.rules import stop_info
from cxbridge.rights import Right
from cxbridge_studio.debugger.breakpoints import parse_breakpoint
from cxbridge_studio.debugger.debugger import debugger_of

if TYPE_CHECKING:
    from cxbridge_studio.debugger.breakpoints import Breakpoint
    from cxbridge_studio.debugger.debugger import Debugger

OPERATIONS: Final = Operations()
_PATH: Final = "/cxbridge/debugger"


class _BreakpointSpecs(Struct):
    specs: list[str]


class _BreakpointSpec(Struct):
    spec: str


class _BreakpointNumbers(Struct):
    numbers: list[int] = []
    all: bool = False


class _BreakpointNumber(Struct):
    number: int


class _Step(Struct):
    what: Annotated[str, Meta(extra_json_schema={"enum": ["rule", "loop", "transition"]})]


class BreakpointInfo(Struct):
    """A breakpoint."""

    number: int
    spec: str  # the breakpoint as a client sets it, e.g. `rule:NAME`


class DebuggerInfo(Struct):
    """The state of the debugger.

    :param stopped: the current stop; unset while the rules run.
    """

    breakpoints: list[BreakpointInfo]
    stopped: StopInfo | UnsetType = UNSET


def list_breakpoint_infos(debugger: Debugger | None) -> list[BreakpointInfo]:
    """Return the breakpoints of a debugger; none without a debugger."""
    return (
        []
        if debugger is None
        else [_make_breakpoint_info(shown_breakpoint) for shown_breakpoint in debugger.breakpoints]
    )


def _make_breakpoint_info(shown_breakpoint: Breakpoint) -> BreakpointInfo:
    return BreakpointInfo(shown_breakpoint.number, str(shown_breakpoint))


def _check_executive_runs(context: OperationContext, _path: Mapping[str, str]) -> None:
    """Check that the executive runs; called before the body of a request is parsed.

    :raises UnavailableError: if it does not; the status over HTTP is 503.
    """
    _ = context.executive


def _describe_debugger(context: OperationContext, _parameters: object) -> DebuggerInfo:
    debugger = debugger_of(context.executive)
    return DebuggerInfo(list_breakpoint_infos(debugger), stop_info(debugger) or UNSET)


def _make_debugger_route(method: str, path: str, summary: str, **settings: Any) -> Route[Any]:
    """Return a route whose response is the state of the debugger."""
    settings = {"answer": _describe_debugger, "check": _check_executive_runs, **settings}
    return Route(method, f"{_PATH}{path}", summary, DebuggerInfo, "Debugger", **settings)


OPERATIONS.add(
    "debugger",
    Right.LOOK,
    NoParameters,
    _make_debugger_route("GET", "", "Return the breakpoints, and the stop of the rules if they are stopped."),
    is_verb=False,
)(_describe_debugger)


@OPERATIONS.add("break-list", Right.LOOK, NoParameters)
def _list_breakpoints(context: OperationContext, _parameters: NoParameters) -> list[BreakpointInfo]:
    return list_breakpoint_infos(debugger_of(context.executive))


# over HTTP, a request adds or removes one breakpoint or removes all; a verb of RequestInterface takes lists
@OPERATIONS.add(
    "break-add-one",
    Right.CONTROL,
    _BreakpointSpec,
    Route(
        "POST",
        f"{_PATH}/breakpoints",
        "Add a breakpoint.",
        BreakpointInfo,
        "Breakpoint",
        check=_check_executive_runs,
        body="BreakpointSpec",
        errors={400: "The text is not a breakpoint, or the breakpoint is unreachable"},
    ),
    is_verb=False,
)
def _add_breakpoint(context: OperationContext, parameters: _BreakpointSpec) -> BreakpointInfo:
    return _make_breakpoint_info(
        debugger_of(context.executive).add(_parse_permitted_breakpoint(context, parameters.spec))
    )


def _parse_permitted_breakpoint(context: OperationContext, spec: str) -> Breakpoint:
    """Parse the breakpoint that a client wants to set.

    :raises CxbridgeError: if the text is not a breakpoint, the breakpoint is unreachable, or the client lacks
        a right.
    """
    new_breakpoint = parse_breakpoint(spec)
    # Conditions and the expressions in log texts are programs: CLIPS evaluates them in the agent's
    # environment.
    if new_breakpoint.condition or "{" in new_breakpoint.log_message:
        context.rights.check(Right.PROGRAMS, "an expression in a breakpoint")
    debugger_of(context.executive).breakpoint_checker.check(new_breakpoint)
    return new_breakpoint


@OPERATIONS.add("break-add", Right.CONTROL, _BreakpointSpecs)
def _add_breakpoints(context: OperationContext, parameters: _BreakpointSpecs) -> list[BreakpointInfo]:
    # All texts are checked before the first breakpoint is added, so that a mistake in one text adds none.
    breakpoints = [_parse_permitted_breakpoint(context, spec) for spec in parameters.specs]
    return [
        _make_breakpoint_info(debugger_of(context.executive).add(new_breakpoint))
        for new_breakpoint in breakpoints
    ]


@OPERATIONS.add("break-remove", Right.CONTROL, _BreakpointNumbers)
def _remove_breakpoints(context: OperationContext, parameters: _BreakpointNumbers) -> None:
    if parameters.all:
        debugger_of(context.executive).clear()
    for number in parameters.numbers:
        debugger_of(context.executive).remove(number)


@OPERATIONS.add(
    "break-remove-one",
    Right.CONTROL,
    _BreakpointNumber,
    _make_debugger_route(
        "DELETE",
        "/breakpoints/{number}",
        "Remove a breakpoint.",
        errors={404: "There is no such breakpoint"},
    ),
    is_verb=False,
)
def _remove_breakpoint(context: OperationContext, parameters: _BreakpointNumber) -> None:
    debugger_of(context.executive).remove(parameters.number)


@OPERATIONS.add(
    "break-clear",
    Right.CONTROL,
    NoParameters,
    _make_debugger_route("DELETE", "/breakpoints", "Remove all breakpoints."),
    is_verb=False,
)
def _clear_breakpoints(context: OperationContext, _parameters: NoParameters) -> None:
    debugger_of(context.executive).clear()


@OPERATIONS.add(
    "step", Right.CONTROL, _Step, _make_debugger_route("POST", "/step", "Continue for one step.", body="Step")
)
def _step_rules(context: OperationContext, parameters: _Step) -> None:
    debugger_of(context.executive).step(parameters.what)


@OPERATIONS.add(
    "stop",
    Right.CONTROL,
    NoParameters,
    _make_debugger_route("POST", "/stop", "Stop before the next rule fires."),
)
def _stop_rules(context: OperationContext, _parameters: NoParameters) -> None:
    debugger_of(context.executive).stop()


@OPERATIONS.add(
    "go-on",
    Right.CONTROL,
    NoParameters,
    _make_debugger_route("POST", "/go-on", "Continue to the next breakpoint."),
)
def _resume_rules(context: OperationContext, _parameters: NoParameters) -> None:
    debugger_of(context.executive).go_on()
