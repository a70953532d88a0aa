"""Monitors of a whole run: the run ends, has no errors in rules, and releases its Skillers."""

from __future__ import annotations

from typing import Final

from cxbridge.events import Event, InterfaceMessage, Level, LogLine
from cxbridge.run.stuck import RULE_ERROR_CODE
from cxbridge_explore.properties.monitor import Ending, Monitor, RunEnd, Scene

_SKILLER_TYPE: Final = "SkillerInterface"


class RunEndMonitor(Monitor):
    """Checks that the run ends: all root goals are finished or maintained."""

    def check_end(self, end: RunEnd) -> None:
        self.is_evaluated = True
        if end.ending is not Ending.OVER:
            failure = "is stuck" if end.ending is Ending.STUCK else "has not ended"
            reason = f": {end.reason}" if end.reason else ""
            self.scene.report(f"the run {failure}{reason}", goal=self._find_open_goal())

    def _find_open_goal(self) -> str:
        """Return the id of a root goal that is not RETRACTED; empty without such a goal."""
        for tables in self.scene.tables:
            for slots in tables.facts("goal"):
                if slots["parent"] == "nil" and slots["mode"] != "RETRACTED":
                    return str(slots["id"])
        return ""


class ErrorMonitor(Monitor):
    """Checks that no rule, and no Python function that a rule calls, has a run-time error."""

    event_types = (LogLine,)

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        # The text of the last error. CLIPS describes an error before the message with `RULE_ERROR_CODE`.
        self._last_error = ""

    def handle_event(self, event: Event) -> None:
        self.is_evaluated = True
        if isinstance(event, LogLine) and event.level is Level.ERROR:
            if event.text.startswith(RULE_ERROR_CODE):
                # without an earlier message, two spaces would follow each other
                self.scene.report(f"an error in a rule: {self._last_error} {event.text}".replace("  ", " "))
            self._last_error = event.text

    def check(self) -> None:
        """Report faults in Python functions that rules call."""
        for tables in self.scene.tables:
            if tables.env.faults:
                self.scene.report(tables.env.faults[0])


class SkillerReleaseMonitor(Monitor):
    """Checks that the shutdown rules release the control of each Skiller."""

    event_types = (InterfaceMessage,)

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._controlled_skillers: list[str] = []

    def check_end(self, end: RunEnd) -> None:  # noqa: ARG002 - the same for each kind of end
        """Record the Skillers under control."""
        self._controlled_skillers = [
            str(slots["skiller"])
            for tables in self.scene.tables
            for slots in tables.facts("skiller-control")
            if slots["acquired"] == "TRUE"
        ]

    def handle_event(self, event: Event) -> None:
        if isinstance(event, InterfaceMessage) and event.message == "ReleaseControlMessage":
            self.is_evaluated = True
            self._controlled_skillers = [
                name for name in self._controlled_skillers if f"{_SKILLER_TYPE}::{name}" != event.uid
            ]

    def check_shutdown(self) -> None:
        """Report the Skillers that are still under control."""
        for skiller in self._controlled_skillers:
            self.scene.report(f"the control of {skiller} was not released at the end", skill=skiller)
