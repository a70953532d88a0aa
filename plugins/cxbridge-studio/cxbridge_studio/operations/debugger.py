"""The operations of the debugger: breakpoints, steps, current stop; docs/debugging.md."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Final

from msgspec import UNSET, Meta, Struct, UnsetType

from cxbridge.daemon.operations.answers import StopInfo
from cxbridge.daemon.operations.operation import (
    NoParameters,
    NotFoundError,
    OperationContext,
    Operations,
    Route,
)
from cxbridge.daemon.operations.rules import stop_info
from cxbridge.errors import CxbridgeError
from cxbridge.rights import Right
from cxbridge_studio.debugger.breakpoints import parse_breakpoint
from cxbridge_studio.debugger.debugger import debugger_of

if TYPE_CHECKING:
    from cxbridge_studio.debugger.breakpoints import Breakpoint
    from cxbridge_studio.debugger.debugger import Debugger

OPERATIONS: Final = Operations()
_PATH: Final = "/cxbridge/debugger"
_MAX_DIGITS: Final = 9  # of the number of a breakpoint: longer texts of a client are not parsed


class _Specs(Struct):
    specs: list[str]


class _Spec(Struct):
    spec: str


class _Numbers(Struct):
    numbers: list[int] = []
    all: bool = False


class _Number(Struct):
    number: int


class _Step(Struct):
    what: Annotated[str, Meta(extra_json_schema={"enum": ["rule", "loop", "transition"]})]


class BreakpointInfo(Struct):
    """A breakpoint."""

    number: int
    spec: str


class DebuggerInfo(Struct):
    """The state of the debugger; ``stopped`` while the rules are stopped."""

    breakpoints: list[BreakpointInfo]
    stopped: StopInfo | UnsetType = UNSET


def breakpoint_rows(debugger: Debugger | None) -> list[BreakpointInfo]:
    return [] if debugger is None else [_describe(item) for item in debugger.breakpoints]


def _describe(item: Breakpoint) -> BreakpointInfo:
    return BreakpointInfo(item.number, str(item))


def _check_number(context: OperationContext, path: Mapping[str, str]) -> None:
    text, numbers = path["number"], [item.number for item in debugger_of(context.executive).breakpoints]
    if not (text.isascii() and text.isdecimal()) or len(text) > _MAX_DIGITS:
        raise CxbridgeError("A breakpoint has a number")
    if int(text) not in numbers:
        raise NotFoundError(f"There is no breakpoint {text}")


def _check_available(context: OperationContext, _path: Mapping[str, str]) -> None:
    """Raise an error if the executive is not running: the client then gets status 503, whatever it sends."""
    _ = debugger_of(context.executive)


def _state(context: OperationContext, _parameters: object) -> DebuggerInfo:
    debugger = debugger_of(context.executive)
    return DebuggerInfo(breakpoint_rows(debugger), stop_info(debugger) or UNSET)


def _route(method: str, path: str, summary: str, **settings: Any) -> Route[Any]:
    """Return a route whose answer is the state of the debugger."""
    settings = {"answer": _state, "check": _check_available, **settings}
    return Route(method, f"{_PATH}{path}", summary, DebuggerInfo, "Debugger", **settings)


OPERATIONS.add(
    "debugger",
    Right.LOOK,
    NoParameters,
    _route("GET", "", "Return the breakpoints, and the stop of the rules if they are stopped."),
    is_verb=False,
)(_state)


@OPERATIONS.add("break-list", Right.LOOK, NoParameters)
def _list(context: OperationContext, _parameters: NoParameters) -> list[BreakpointInfo]:
    return breakpoint_rows(debugger_of(context.executive))


@OPERATIONS.add(
    "break-add-one",
    Right.CONTROL,
    _Spec,
    Route(
        "POST",
        f"{_PATH}/breakpoints",
        "Add a breakpoint.",
        BreakpointInfo,
        "Breakpoint",
        check=_check_available,
        body="BreakpointSpec",
        errors={400: "The text is not a breakpoint, or the breakpoint is unreachable"},
    ),
    is_verb=False,
)
def _add(context: OperationContext, parameters: _Spec) -> BreakpointInfo:
    return _describe(debugger_of(context.executive).add(_checked(context, parameters.spec)))


def _checked(context: OperationContext, spec: str) -> Breakpoint:
    """Return the breakpoint of a text.

    :raises CxbridgeError: if the text is invalid, the breakpoint is unreachable, or the client may not set
        it.
    """
    item = parse_breakpoint(spec)
    # CLIPS evaluates conditions and the expressions of log texts in the agent's environment.
    if item.condition or "{" in item.log:
        context.rights.check(Right.PROGRAMS, "an expression in a breakpoint")
    debugger_of(context.executive).names.check(item)
    return item


@OPERATIONS.add("break-add", Right.CONTROL, _Specs)
def _add_all(context: OperationContext, parameters: _Specs) -> list[BreakpointInfo]:
    # All texts are checked before the first breakpoint is added: a mistake leaves none behind.
    breakpoints = [_checked(context, spec) for spec in parameters.specs]
    return [_describe(debugger_of(context.executive).add(item)) for item in breakpoints]


@OPERATIONS.add("break-remove", Right.CONTROL, _Numbers)
def _remove_all(context: OperationContext, parameters: _Numbers) -> None:
    if parameters.all:
        debugger_of(context.executive).clear()
    for number in parameters.numbers:
        debugger_of(context.executive).remove(number)


@OPERATIONS.add(
    "break-remove-one",
    Right.CONTROL,
    _Number,
    _route(
        "DELETE",
        "/breakpoints/{number}",
        "Remove a breakpoint.",
        check=_check_number,
        errors={404: "There is no such breakpoint"},
    ),
    is_verb=False,
)
def _remove(context: OperationContext, parameters: _Number) -> None:
    debugger_of(context.executive).remove(parameters.number)


@OPERATIONS.add(
    "break-clear",
    Right.CONTROL,
    NoParameters,
    _route("DELETE", "/breakpoints", "Remove all breakpoints."),
    is_verb=False,
)
def _clear(context: OperationContext, _parameters: NoParameters) -> None:
    debugger_of(context.executive).clear()


@OPERATIONS.add("step", Right.CONTROL, _Step, _route("POST", "/step", "Continue for one step.", body="Step"))
def _step(context: OperationContext, parameters: _Step) -> None:
    debugger_of(context.executive).step(parameters.what)


@OPERATIONS.add(
    "stop", Right.CONTROL, NoParameters, _route("POST", "/stop", "Stop before the next rule fires.")
)
def _stop(context: OperationContext, _parameters: NoParameters) -> None:
    debugger_of(context.executive).stop()


@OPERATIONS.add(
    "go-on", Right.CONTROL, NoParameters, _route("POST", "/go-on", "Continue to the next breakpoint.")
)
def _go_on(context: OperationContext, _parameters: NoParameters) -> None:
    debugger_of(context.executive).go_on()
