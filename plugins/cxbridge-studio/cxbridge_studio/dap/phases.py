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


ANY: Final = ~SessionPhase(0)
KNOWN: Final = ANY & ~SessionPhase.NEW  # any phase after `initialize`
LAUNCHED: Final = KNOWN & ~SessionPhase.READY  # any phase after `launch`

# The reasons why a request is invalid, by the current phase.
_WHY_NOT: Final = {
    SessionPhase.NEW: "nothing has been launched: a session begins with the request 'initialize'",
    SessionPhase.READY: "nothing has been launched",
    SessionPhase.LAUNCHED: "nothing is stopped now: nothing runs before the request 'configurationDone'",
    SessionPhase.RUNNING: "nothing is stopped now",
    SessionPhase.STOPPED: "it is stopped already",
    SessionPhase.OVER: "the run is over",
}
# The errors of requests that a session has only once.
_ONCE: Final = {
    "initialize": "the session is initialized already",
    "launch": "something has been launched already",
    "configurationDone": "it runs already",
}


def check_phase(command: str, allowed: SessionPhase, now: SessionPhase) -> None:
    """Check that a request is valid in the current phase.

    :param allowed: the phases in which the request is valid.
    :raises CxbridgeError: if the request is invalid now.
    """
    if now in allowed:
        return
    # The values of the flags are in the order of a session: compare with the first allowed phase.
    is_too_early = now.value < allowed.value & -allowed.value
    if command in _ONCE and not is_too_early:
        raise CxbridgeError(_ONCE[command])
    raise CxbridgeError(_WHY_NOT[now])
