"""Properties of the end of a run: it ends, without CLIPS errors, and releases its Skillers."""

from __future__ import annotations

from typing import Final

from cxbridge.events import Event, InterfaceMessage, Level, LogLine
from cxbridge_explore.properties.monitor import Ending, Monitor, RunEnd

# Prefix of CLIPS' message with the rule of an error; the message before it has the error.
_HALTED: Final = "[PRCCODE4]"

_SKILLER: Final = "SkillerInterface"


class RunEnds(Monitor):
    """The run ends: all root goals are finished, or are maintained."""

    def end(self, end: RunEnd) -> None:
        self.is_evaluated = True
        reason = f": {end.reason}" if end.reason else ""
        if end.ending is Ending.STUCK:
            self.scene.report(f"the run is stuck{reason}", goal=self._open_goal())
        elif end.ending is Ending.CUT:
            self.scene.report(f"the run has not come to its end{reason}", goal=self._open_goal())

    def _open_goal(self) -> str:
        for tables in self.scene.tables:
            for slots in tables.facts("goal"):
                if slots["parent"] == "nil" and slots["mode"] != "RETRACTED":
                    return str(slots["id"])
        return ""


class NoErrors(Monitor):
    """No rule has a run-time error."""

    event_types = (LogLine,)

    def begin(self) -> None:
        self._last_error = ""

    def take(self, event: Event) -> None:
        self.is_evaluated = True
        if isinstance(event, LogLine) and event.level is Level.ERROR:
            if event.text.startswith(_HALTED):
                self.scene.report(f"an error in a rule: {self._last_error} {event.text}".replace("  ", " "))
            self._last_error = event.text

    def look(self) -> None:
        """Report faults in Python functions that rules call."""
        for tables in self.scene.tables:
            if tables.env.faults:
                self.scene.report(tables.env.faults[0])


class SkillersReleased(Monitor):
    """The shutdown rules release the control of each Skiller."""

    event_types = (InterfaceMessage,)

    def begin(self) -> None:
        self._held: dict[str, None] = {}

    def end(self, end: RunEnd) -> None:  # noqa: ARG002 - the same for each kind of end
        """Record the Skillers under control."""
        for tables in self.scene.tables:
            for slots in tables.facts("skiller-control"):
                if slots["acquired"] == "TRUE":
                    self._held[f"{_SKILLER}::{slots['skiller']}"] = None

    def take(self, event: Event) -> None:
        if isinstance(event, InterfaceMessage) and event.message == "ReleaseControlMessage":
            self._held.pop(event.uid, None)
            self.is_evaluated = True

    def released(self) -> None:
        """Report the Skillers that are still under control."""
        for uid in self._held:
            skiller = uid.removeprefix(f"{_SKILLER}::")
            self.scene.report(f"the control of {skiller} was not released at the end", skill=skiller)
