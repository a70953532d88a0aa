"""The phases of a debug session, and which requests each of them has an answer to."""

from __future__ import annotations

from enum import Flag, auto
from typing import Final

from cxbridge.errors import CxbridgeError


class SessionPhase(Flag):
    """How far a session has come."""

    NEW = auto()
    """The client has not said who it is."""
    READY = auto()
    """Nothing has been launched."""
    LAUNCHED = auto()
    """The client says where to stop; ``configurationDone`` begins the run."""
    RUNNING = auto()
    STOPPED = auto()
    OVER = auto()
    """The run has ended."""


ANY: Final = ~SessionPhase(0)
KNOWN: Final = ANY & ~SessionPhase.NEW
"""The client has said who it is."""
LAUNCHED: Final = KNOWN & ~SessionPhase.READY
"""There is something to debug, or there was."""

_WHY_NOT: Final = {
    SessionPhase.NEW: "nothing has been launched: a session begins with the request 'initialize'",
    SessionPhase.READY: "nothing has been launched",
    SessionPhase.LAUNCHED: "nothing is stopped now: nothing runs before the request 'configurationDone'",
    SessionPhase.RUNNING: "nothing is stopped now",
    SessionPhase.STOPPED: "it is stopped already",
    SessionPhase.OVER: "the run is over",
}
_ONCE: Final = {
    "initialize": "the session is initialized already",
    "launch": "something has been launched already",
    "configurationDone": "it runs already",
}


def check_phase(command: str, allowed: SessionPhase, now: SessionPhase) -> None:
    """See that a request makes sense now.

    :param allowed: the phases in which it does.
    :raises CxbridgeError: when it does not.
    """
    if now in allowed:
        return
    before = now.value < allowed.value & -allowed.value  # the phase comes before all that are allowed
    if command in _ONCE and not before:
        raise CxbridgeError(_ONCE[command])
    raise CxbridgeError(_WHY_NOT[now])
