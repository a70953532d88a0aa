"""The phases of a debug session, and the requests that are valid in each."""

from __future__ import annotations

from enum import Flag, auto
from typing import Final

from cxbridge.errors import CxbridgeError


class SessionPhase(Flag):
    NEW = auto()  # before `initialize`
    READY = auto()  # before `launch`
    LAUNCHED = auto()  # the client sets breakpoints; `configurationDone` starts the run
    RUNNING = auto()
    STOPPED = auto()
    OVER = auto()


ANY_PHASE: Final = ~SessionPhase(0)
AFTER_INITIALIZE: Final = ANY_PHASE & ~SessionPhase.NEW  # any phase after `initialize`
AFTER_LAUNCH: Final = AFTER_INITIALIZE & ~SessionPhase.READY  # any phase after `launch`

# the errors about invalid requests, by the current phase
_PHASE_ERRORS: Final = {
    SessionPhase.NEW: "nothing has been launched: a session begins with the request 'initialize'",
    SessionPhase.READY: "nothing has been launched",
    SessionPhase.LAUNCHED: "nothing is stopped now: nothing runs before the request 'configurationDone'",
    SessionPhase.RUNNING: "nothing is stopped now",
    SessionPhase.STOPPED: "the run is stopped already",
    SessionPhase.OVER: "the run is over",
}
# the errors about a repetition of requests that a session may have only once
_REPETITION_ERRORS: Final = {
    "initialize": "the session is initialized already",
    "launch": "something has been launched already",
    "configurationDone": "the run has started already",
}


def check_phase(command: str, allowed: SessionPhase, current: SessionPhase) -> None:
    """Check that a request is valid in the current phase.

    :param allowed: the phases in which the request is valid.
    :raises CxbridgeError: if the request is invalid now.
    """
    if current in allowed:
        return
    # The values of the flags grow in the order of a session. `x & -x` is the smallest flag in x: the first
    # phase in which the request is allowed.
    is_too_early = current.value < allowed.value & -allowed.value
    if command in _REPETITION_ERRORS and not is_too_early:
        raise CxbridgeError(_REPETITION_ERRORS[command])
    raise CxbridgeError(_PHASE_ERRORS[current])
