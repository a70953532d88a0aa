"""A finished run as an object: goals, plan-actions and skills, with output as text, HTML and files."""

from __future__ import annotations

from base64 import b64encode
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import CxbridgeError
from cxbridge.events import Level, LogLine
from cxbridge.file_access import write_file
from cxbridge.history.builder import RunHistory
from cxbridge.history.model import GoalRecord, PlanActionRecord, SkillExecution, find_goals, goal_tree
from cxbridge.printing import format_count
from cxbridge.run.explainers import why
from cxbridge.run.pages import VIEWS
from cxbridge.trace.formats import registry
from cxbridge.trace.formats.base import Run as RecordedRun

if TYPE_CHECKING:
    from cxbridge.trace.compare.model import Comparison


_REPORT: Final = "report"


class Run:
    """A finished run, from :func:`run` or a recording.

    ``str()`` returns the goal tree with outcomes. A notebook shows a page with the timeline.
    """

    def __init__(self, source: RecordedRun) -> None:
        self.source = source

    @property
    def status(self) -> int | None:
        """The exit status of ``cxbridge run``; None if not recorded.

        Status 0: success, usually because every root goal is COMPLETED; 1: a root goal is not; 3: timeout, or
        the run was stuck; 4: a fault, e.g. a lost connection. The comparison of a replay has no effect here.
        """
        return self.source.exit_status()

    @property
    def reason(self) -> str:
        """The reason for the status, in a sentence; empty if not recorded."""
        return self.source.metadata().get("reason", "")

    @property
    def seconds(self) -> float:
        """The duration by the run's clock."""
        return self.history.end / MICROSECONDS

    @cached_property
    def history(self) -> RunHistory:
        """The history of goals, plan-actions, skills and planner calls.

        :raises TraceError: if the recording cannot be read.
        """
        return RunHistory.from_events(self.source, start_us=self.source.start_us)

    @property
    def goals(self) -> list[GoalRecord]:
        """The goals in order of appearance."""
        return self.history.goals

    @property
    def actions(self) -> list[PlanActionRecord]:
        """The plan-actions in order of appearance."""
        return self.history.actions

    @property
    def skills(self) -> list[SkillExecution]:
        """The executed skills in order of their start."""
        return self.history.calls

    def goal(self, name: str) -> GoalRecord:
        """Return a goal by id or the start of its id, or the only goal of a class.

        ``ID#2`` is the second goal with this id.

        :raises CxbridgeError: unless exactly one goal matches.
        """
        goals = find_goals(self.goals, name)
        if len(goals) != 1:
            classes = ", ".join(dict.fromkeys(goal.goal_class for goal in self.goals)) or "none"
            raise CxbridgeError(
                f"{len(goals) or 'no'} goals match '{name}'",
                hint=f"give an id, or one of the classes: {classes}",
            )
        return goals[0]

    def log(self, level: str = "I") -> list[LogLine]:
        """Return the log lines.

        :param level: the minimum level: ``D`` (debug), ``I`` (info), ``W`` (warning) or ``E`` (error).
        :raises ValueError: if there is no such level.
        """
        levels = list(Level)
        included_levels = levels[levels.index(Level(level)) :]
        return [
            event
            for event in self.source.select(LogLine)
            if isinstance(event, LogLine) and event.level in included_levels
        ]

    def why(self, name: str) -> str:
        """Explain the outcome of a goal, or why a rule did not fire.

        :param name: a goal id, a goal class or a rule.
        :raises CxbridgeError: if the name is unknown, the recording is insufficient, or no plug-in explains
            runs.
        """
        return "\n".join(why(self.source, name))

    def compare(self, other: Run | str | Path, *, order: str = "partial") -> Comparison:
        """Compare the transitions of goals and plan-actions with another run.

        :param other: the other run, or its recording.
        :param order: ``partial`` compares each goal separately, ``total`` the sequence of all transitions.
        :raises TraceError: if a recording cannot be read.
        """
        from cxbridge.trace.compare.model import Order, parse_choice  # noqa: PLC0415
        from cxbridge.trace.compare.runs import compare_runs  # noqa: PLC0415

        source = other.source if isinstance(other, Run) else registry.open_run(other)
        return compare_runs(self.source, [source], order=parse_choice(Order, "order", order))

    def write_report(self, path: str | Path) -> Path:
        """Write a self-contained HTML page about the run; return the path of the page.

        :raises CxbridgeError: if the recording cannot be read, the page cannot be written, or no plug-in
            makes such pages.
        """
        write_file(path, VIEWS.load_target(VIEWS.find(_REPORT))(self.source))
        return Path(path)

    def __str__(self) -> str:
        conclusion = f"{self.source.path.name}: {self.reason or 'no result is recorded'}"
        return "\n".join([*goal_tree(self.goals), conclusion])

    def __repr__(self) -> str:
        return f"<Run {self.source.path.name}: status {self.status}, {format_count(len(self.goals), 'goal')}>"

    def _repr_html_(self) -> str:
        """Return HTML for a notebook: a plug-in's report, or the goal tree."""
        row = next((row for row in VIEWS.rows if row.name == _REPORT), None)
        if row is None:
            return f"<pre>{escape(str(self))}</pre>"
        page = b64encode(VIEWS.load_target(row)(self.source).encode("utf-8")).decode()
        return (  # not srcdoc, which would resolve the page's links against the notebook
            f'<iframe src="data:text/html;base64,{page}" title="{escape(repr(self))}" sandbox="allow-scripts"'
            ' style="width:100%;height:36rem;border:0"></iframe>'
        )


def open_run(path: str | Path) -> Run:
    """Open a recorded run of any format, e.g. mcap, a Fawkes text log, or bblogger files.

    :raises TraceError: if ``path`` does not exist or is not a recorded run.
    """
    return Run(registry.open_run(path))
