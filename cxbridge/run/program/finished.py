"""A run that is over, as a program sees it: its goals, plan-actions and skills, as text, HTML and files."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Mapping
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import CxbridgeError
from cxbridge.events import Level, LogLine
from cxbridge.file_access import write_file
from cxbridge.history.builder import RunHistory
from cxbridge.history.model import GoalRecord, PlanActionRecord, SkillExecution, goal_tree, goals_named
from cxbridge.plugins import Table
from cxbridge.run.explainers import why
from cxbridge.trace.formats import registry
from cxbridge.trace.formats.base import Run as RecordedRun

if TYPE_CHECKING:
    from cxbridge.trace.compare.model import Comparison


VIEWS: Final[Table[Callable[..., str]]] = Table(
    "VIEWS", callable, "a function that makes a page, as HTML, of a recorded run"
)
"""The pages about runs; ``document`` makes a page of the kind, the title and the text of a JSON document."""

_REPORT: Final = "report"


def write_document(path: Path, kind: str, title: str, document: Mapping[str, Any]) -> None:
    """Write a page that shows a JSON document.

    :raises CxbridgeError: when no installed package makes pages, or it cannot be written.
    """
    page = VIEWS.load(VIEWS.find("document"))
    write_file(path, page(kind, title, document))


class Run:
    """A run that is over: one that :func:`run` made, or a recording.

    Printed it is the tree of its goals with their outcomes; in a notebook it is a page with its timeline.

    :param source: its events.
    """

    def __init__(self, source: RecordedRun) -> None:
        self.source = source

    # ---- how it ended

    @property
    def status(self) -> int | None:
        """The exit status of ``cxbridge run``; None when the recording does not tell.

        0: every root goal ended COMPLETED; 1: some did not; 3: the time was over; 4: a fault of the run.
        """
        status = self.source.metadata().get("status", "")
        return int(status) if status.isdigit() else None

    @property
    def reason(self) -> str:
        """Why it has this status, in a sentence; empty when the recording does not tell."""
        return self.source.metadata().get("reason", "")

    @property
    def seconds(self) -> float:
        """How long it took by its own clock."""
        return self.history.end / MICROSECONDS

    # ---- what happened

    @cached_property
    def history(self) -> RunHistory:
        """All that happened to goals, plan-actions, skills and planners.

        :raises TraceError: when the recording cannot be read.
        """
        return RunHistory.of(self.source, start_us=self.source.start_us)

    @property
    def goals(self) -> list[GoalRecord]:
        """The goals, in the order in which they appeared."""
        return self.history.goals

    @property
    def actions(self) -> list[PlanActionRecord]:
        """The plan-actions, in the order in which they appeared."""
        return self.history.actions

    @property
    def skills(self) -> list[SkillExecution]:
        """The skills that were executed, in the order in which they began."""
        return self.history.calls

    def goal(self, name: str) -> GoalRecord:
        """Return the goal of an id, or the only goal of a class; ``ID#2`` for the second life of an id.

        :raises CxbridgeError: when there is none, or are several.
        """
        found = goals_named(self.goals, name)
        if len(found) != 1:
            known = ", ".join(dict.fromkeys(goal.goal_class for goal in self.goals)) or "none"
            raise CxbridgeError(
                f"{len(found) or 'no'} goals are '{name}'", hint=f"give an id, or one of the classes: {known}"
            )
        return found[0]

    def log(self, level: str = "I") -> list[LogLine]:
        """Return the log.

        :param level: the least level: ``D`` (debug), ``I`` (info), ``W`` (warning) or ``E`` (error).
        """
        levels = list(Level)
        least = levels.index(Level(level))
        lines = (event for event in self.source.select(LogLine) if isinstance(event, LogLine))
        return [line for line in lines if levels.index(line.level) >= least]

    def why(self, name: str) -> str:
        """Return why a goal came to its outcome, or why a rule did not fire.

        :param name: a goal's id, a class of goals, or a rule.
        :raises CxbridgeError: when there is nothing of that name, the recording cannot tell, or no installed
            package explains runs.
        """
        return "\n".join(why(self.source, name))

    def compare(self, other: Run, *, order: str = "partial") -> Comparison:
        """Compare the transitions of goals and plan-actions with those of another run.

        :param order: ``partial``: that of each goal; ``total``: that of all.
        :raises TraceError: when one of them cannot be read.
        """
        from cxbridge.trace.compare.model import Order  # noqa: PLC0415
        from cxbridge.trace.compare.runs import compare_runs  # noqa: PLC0415

        return compare_runs(self.source, [other.source], order=Order(order))

    # ---- as a recording

    def write_report(self, path: str | Path) -> Path:
        """Write a page about the run, one file that needs no network; return its path.

        :raises TraceError: when it cannot be written.
        """
        report = VIEWS.load(VIEWS.find(_REPORT))
        write_file(Path(path), report(self.source).encode("utf-8"))
        return Path(path)

    def __str__(self) -> str:
        lines = goal_tree(self.goals)
        return "\n".join([*lines, f"{self.source.path.name}: {self.reason or 'no result is recorded'}"])

    def __repr__(self) -> str:
        return f"<Run {self.source.path.name}: status {self.status}, {len(self.goals)} goals>"

    def _repr_html_(self) -> str:
        """Return a page about the run for a notebook: the report of a plug-in, or the tree of goals."""
        row = next((row for row in VIEWS.rows if row.name == _REPORT), None)
        if row is None:
            return f"<pre>{escape(str(self))}</pre>"
        page = b64encode(VIEWS.load(row)(self.source).encode("utf-8")).decode()
        return (  # a document in srcdoc resolves the links of the page against the notebook
            f'<iframe src="data:text/html;base64,{page}" title="{escape(repr(self))}" sandbox="allow-scripts"'
            ' style="width:100%;height:36rem;border:0"></iframe>'
        )


def open_run(path: str | Path) -> Run:
    """Open a recorded run of any format: mcap, a text log of Fawkes, bblogger's files, ...

    :raises TraceError: when there is nothing at ``path``, or nothing that is a recorded run.
    """
    return Run(registry.open_run(path))
