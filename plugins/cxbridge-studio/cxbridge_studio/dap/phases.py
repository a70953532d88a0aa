"""The phases of a debug session, and the check that a request is valid in the current phase."""

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


STOPPED: Final = SessionPhase.STOPPED
ANY_PHASE: Final = ~SessionPhase(0)
AFTER_INITIALIZE: Final = ANY_PHASE & ~SessionPhase.NEW  # any phase after `initialize`
AFTER_LAUNCH: Final = AFTER_INITIALIZE & ~SessionPhase.READY  # any phase after `launch`

# the reasons of the errors about invalid requests, by the current phase
_PHASE_ERRORS: Final = {
    SessionPhase.NEW: "a session begins with the request 'initialize'",
    SessionPhase.READY: "the next step is the request 'launch'",
    SessionPhase.LAUNCHED: "the run begins with the request 'configurationDone'",
    SessionPhase.RUNNING: "the run is going on",
    SessionPhase.STOPPED: "the run is stopped",
    SessionPhase.OVER: "the run is over",
}


def check_phase(command: str, allowed_phases: SessionPhase, current_phase: SessionPhase) -> None:
    """Check that a request is valid in the current phase.

    :param allowed_phases: the phases in which the request is valid.
    :raises CxbridgeError: if the request is invalid now.
    """
    if current_phase not in allowed_phases:
        raise CxbridgeError(f"the request '{command}' is invalid now: {_PHASE_ERRORS[current_phase]}")
