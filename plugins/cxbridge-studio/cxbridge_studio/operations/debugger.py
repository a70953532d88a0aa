"""The operations of the debugger: breakpoints, steps, where the rules are stopped; docs/debugging.md."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Final

from msgspec import UNSET, Meta, Struct, UnsetType, convert

from cxbridge.errors import CxbridgeError
from cxbridge.executive.breakpoints import parse_breakpoint
from cxbridge.operations.answers import StopInfo
from cxbridge.operations.operation import NoParameters, NotFoundError, OperationContext, Operations, Route
from cxbridge.rights import Right

if TYPE_CHECKING:
    from cxbridge.executive.breakpoints import Breakpoint, Stop
    from cxbridge.executive.debugger import Debugger

OPERATIONS: Final = Operations()
_PATH: Final = "/cxbridge/debugger"
_MOST_DIGITS: Final = 9


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
    """How the debugger stands; ``stopped`` while the rules are stopped."""

    breakpoints: list[BreakpointInfo]
    stopped: StopInfo | UnsetType = UNSET


def breakpoint_rows(debugger: Debugger | None) -> list[BreakpointInfo]:
    """Return number and text of each breakpoint."""
    return [] if debugger is None else [_row(item) for item in debugger.breakpoints]


def stop_info(debugger: Debugger | None) -> StopInfo | None:
    """Return where the rules are stopped; None while they are not."""
    stop: Stop | None = None if debugger is None else debugger.stopped
    return None if stop is None else convert(stop, StopInfo, from_attributes=True)


def _row(item: Breakpoint) -> BreakpointInfo:
    return BreakpointInfo(item.number, str(item))


def _check_number(context: OperationContext, path: Mapping[str, str]) -> None:
    text, known = path["number"], [item.number for item in context.debugger.breakpoints]
    if not (text.isascii() and text.isdecimal()) or len(text) > _MOST_DIGITS:
        raise CxbridgeError("A breakpoint has a number")
    if int(text) not in known:
        raise NotFoundError(f"There is no breakpoint {text}")


def _check_there(context: OperationContext, _path: Mapping[str, str]) -> None:
    _ = context.debugger


def _look(context: OperationContext, _given: object) -> DebuggerInfo:
    return DebuggerInfo(breakpoint_rows(context.debugger), stop_info(context.debugger) or UNSET)


def _route(method: str, path: str, about: str, **more: Any) -> Route[Any]:
    """Return a route that answers how the debugger stands."""
    more = {"answer": _look, "check": _check_there, **more}
    return Route(method, f"{_PATH}{path}", about, DebuggerInfo, "Debugger", **more)


OPERATIONS.add(
    "debugger",
    Right.LOOK,
    NoParameters,
    _route("GET", "", "Breakpoints, and where the rules are stopped."),
    is_verb=False,
)(_look)


@OPERATIONS.add("break-list", Right.LOOK, NoParameters)
def _list(context: OperationContext, _given: NoParameters) -> list[BreakpointInfo]:
    return breakpoint_rows(context.debugger)


@OPERATIONS.add("where", Right.LOOK, NoParameters)
def _where(context: OperationContext, _given: NoParameters) -> StopInfo | None:
    return stop_info(context.debugger)


@OPERATIONS.add(
    "break-add-one",
    Right.CONTROL,
    _Spec,
    Route(
        "POST",
        f"{_PATH}/breakpoints",
        "Stop there from now on.",
        BreakpointInfo,
        "Breakpoint",
        check=_check_there,
        body="BreakpointSpec",
        errors={400: "That is not a breakpoint, or nothing can ever reach it"},
    ),
    is_verb=False,
)
def _add(context: OperationContext, given: _Spec) -> BreakpointInfo:
    return _row(context.debugger.add(_checked(context, given.spec)))


def _checked(context: OperationContext, spec: str) -> Breakpoint:
    """Return the breakpoint of a text.

    :raises CxbridgeError: when it is none, nothing can ever reach it, or the client may not set it.
    """
    made = parse_breakpoint(spec)
    if made.condition or "{" in made.log:
        context.rights.check(Right.PROGRAMS, "an expression in a breakpoint")
    context.debugger.names.check(made)
    return made


@OPERATIONS.add("break-add", Right.CONTROL, _Specs)
def _add_all(context: OperationContext, given: _Specs) -> list[BreakpointInfo]:
    made = [_checked(context, spec) for spec in given.specs]  # all of them, or none
    return [_row(context.debugger.add(item)) for item in made]


@OPERATIONS.add("break-remove", Right.CONTROL, _Numbers)
def _remove_all(context: OperationContext, given: _Numbers) -> None:
    if given.all:
        context.debugger.clear()
    for number in given.numbers:
        context.debugger.remove(number)


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
def _remove(context: OperationContext, given: _Number) -> None:
    context.debugger.remove(given.number)


@OPERATIONS.add(
    "break-clear",
    Right.CONTROL,
    NoParameters,
    _route("DELETE", "/breakpoints", "Remove all breakpoints."),
    is_verb=False,
)
def _clear(context: OperationContext, _given: NoParameters) -> None:
    context.debugger.clear()


@OPERATIONS.add("step", Right.CONTROL, _Step, _route("POST", "/step", "Go on for one step.", body="Step"))
def _step(context: OperationContext, given: _Step) -> None:
    context.debugger.step(given.what)


@OPERATIONS.add(
    "stop", Right.CONTROL, NoParameters, _route("POST", "/stop", "Stop before the next rule fires.")
)
def _stop(context: OperationContext, _given: NoParameters) -> None:
    context.debugger.stop()


@OPERATIONS.add(
    "go-on", Right.CONTROL, NoParameters, _route("POST", "/go-on", "Go on to the next breakpoint.")
)
def _go_on(context: OperationContext, _given: NoParameters) -> None:
    context.debugger.go_on()
