"""Properties of how a run ends: it does, without errors of CLIPS, and lets go of its Skillers."""

from __future__ import annotations

from typing import Final

from cxbridge.events import Event, InterfaceMessage, Level, LogLine
from cxbridge_explore.properties.monitor import Ending, Monitor, RunEnd

_HALTED: Final = "[PRCCODE4]"
"""The beginning of CLIPS' message with the rule of an error; the error itself is the message before."""

_SKILLER: Final = "SkillerInterface"


class RunEnds(Monitor):
    """The run comes to its end: all root goals are over, or maintain."""

    def end(self, end: RunEnd) -> None:
        """Report an end of another kind."""
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
        """Note the present state."""
        self._last_error = ""

    def take(self, event: Event) -> None:
        """Take a line of the log."""
        self.is_evaluated = True
        if isinstance(event, LogLine) and event.level is Level.ERROR:
            if event.text.startswith(_HALTED):
                self.scene.report(f"an error in a rule: {self._last_error} {event.text}".replace("  ", " "))
            self._last_error = event.text

    def look(self) -> None:
        """Look for faults of functions in Python that rules call."""
        for tables in self.scene.tables:
            if tables.env.faults:
                self.scene.report(tables.env.faults[0])


class SkillersReleased(Monitor):
    """The rules for the shutdown release the control of each Skiller that the agent has."""

    event_types = (InterfaceMessage,)

    def begin(self) -> None:
        """Nothing is to be released yet."""
        self._held: dict[str, None] = {}

    def end(self, end: RunEnd) -> None:  # noqa: ARG002 - however it ends
        """Note which Skillers obey the agents."""
        for tables in self.scene.tables:
            for slots in tables.facts("skiller-control"):
                if slots["acquired"] == "TRUE":
                    self._held[f"{_SKILLER}::{slots['skiller']}"] = None

    def take(self, event: Event) -> None:
        """Take a message to a Skiller."""
        if isinstance(event, InterfaceMessage) and event.message == "ReleaseControlMessage":
            self._held.pop(event.uid, None)
            self.is_evaluated = True

    def released(self) -> None:
        """Look which of them are left."""
        for uid in self._held:
            skiller = uid.removeprefix(f"{_SKILLER}::")
            self.scene.report(f"the control of {skiller} was not released at the end", skill=skiller)
