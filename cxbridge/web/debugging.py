"""The executive's debugger: breakpoints, steps, and where it has stopped; docs/debugging.md."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cxbridge.executive.breakpoints import parse_breakpoint
from cxbridge.rights import Right
from cxbridge.web.endpoint import API_VERSION, ApiError, Call, Endpoint, Handler

if TYPE_CHECKING:
    from cxbridge.executive.debugger import Debugger

_MOST_DIGITS: Final = 9
_PATH: Final = "/cxbridge/debugger"


def stopped(debugger: Debugger | None) -> dict[str, Any]:
    """Return the member ``stopped``; nothing while rules are not."""
    stop = None if debugger is None else debugger.stopped
    return {} if stop is None else {"stopped": stop.plain()}


def _debugger(call: Call) -> Debugger:
    """Return the debugger.

    :raises ApiError: when there is no executive.
    """
    found = call.host.debugger
    if found is None:
        raise ApiError(503, "The executive is not there now")
    return found


def _look(call: Call) -> dict[str, Any]:
    debugger = _debugger(call)
    return {
        "kind": "Debugger",
        "apiVersion": API_VERSION,
        "breakpoints": [{"number": item.number, "spec": str(item)} for item in debugger.breakpoints],
        **stopped(debugger),
    }


def _add(call: Call) -> dict[str, Any]:
    debugger, spec = _debugger(call), call.text("spec")
    if parse_breakpoint(spec).condition:
        call.host.rights.check(Right.PROGRAMS, "the condition of a breakpoint")
    made = debugger.add(spec)
    return {"kind": "Breakpoint", "apiVersion": API_VERSION, "number": made.number, "spec": str(made)}


def _remove(call: Call) -> dict[str, Any]:
    text, debugger = call.path["number"], _debugger(call)
    if not (text.isascii() and text.isdecimal()) or len(text) > _MOST_DIGITS:
        raise ApiError(400, "A breakpoint has a number")
    if all(item.number != int(text) for item in debugger.breakpoints):
        raise ApiError(404, f"There is no breakpoint {text}")
    debugger.remove(int(text))
    return _look(call)


def _clear(call: Call) -> dict[str, Any]:
    _debugger(call).clear()
    return _look(call)


def _step(call: Call) -> dict[str, Any]:
    _debugger(call).step(call.text("what"))
    return _look(call)


def _stop(call: Call) -> dict[str, Any]:
    _debugger(call).stop()
    return _look(call)


def _go_on(call: Call) -> dict[str, Any]:
    _debugger(call).go_on()
    return _look(call)


def _change(method: str, path: str, handler: Handler, about: str, **more: Any) -> Endpoint:
    reply = more.pop("reply", "Debugger")
    return Endpoint(
        method=method,
        path=f"{_PATH}{path}",
        handler=handler,
        about=about,
        reply=reply,
        changes=True,
        **more,
    )


ENDPOINTS: Final = (
    Endpoint(
        method="GET",
        path=_PATH,
        handler=_look,
        about="Breakpoints, and where the rules are stopped.",
        reply="Debugger",
    ),
    _change(
        "POST",
        "/breakpoints",
        _add,
        "Stop there from now on.",
        reply="Breakpoint",
        body="BreakpointSpec",
        errors={400: "That is no breakpoint"},
    ),
    _change(
        "DELETE",
        "/breakpoints/{number}",
        _remove,
        "Remove a breakpoint.",
        errors={404: "There is no such breakpoint"},
    ),
    _change("DELETE", "/breakpoints", _clear, "Remove all breakpoints."),
    _change("POST", "/step", _step, "Go on for one step.", body="Step"),
    _change("POST", "/stop", _stop, "Stop before the next rule fires."),
    _change("POST", "/go-on", _go_on, "Go on to the next breakpoint."),
)
