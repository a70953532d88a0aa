"""The studio's module in the table of explainers (docs/plugins.md).

The core calls these functions when a run fails or is explained. Each function imports the parts of the studio
that it needs, because most calls need only one part.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cxbridge.errors import BrokenAgentError
from cxbridge.run.explainers import RunExplainer
from cxbridge.run.options import RunOptions
from cxbridge.trace.formats.base import Run as RecordedRun

if TYPE_CHECKING:
    from cxbridge.run.agent import Run


def why(run: RecordedRun, name: str) -> Sequence[str]:
    """Return the lines that explain the outcome of a goal, or why a rule did not fire."""
    from cxbridge_studio.explain.answer import explain  # noqa: PLC0415 - see the docstring of the module
    from cxbridge_studio.explain.recorded import RecordedEvidence  # noqa: PLC0415

    return explain(RecordedEvidence(run, None, None), name).lines


def explainer(run: RecordedRun, at_s: float | None, env: str | None) -> RunExplainer:
    """Return the function that answers questions about a recorded run at a moment.

    :param at_s: the moment in seconds since the start of the run; None for the end.
    :param env: the CLIPS environment; None for the executive's.
    """
    from cxbridge_studio.explain.answer import explain  # noqa: PLC0415
    from cxbridge_studio.explain.recorded import RecordedEvidence  # noqa: PLC0415

    evidence = RecordedEvidence(run, at_s, env)
    recording_notes = [*evidence.notes]

    def answer(kind: str, name: str) -> Mapping[str, Any]:
        evidence.notes = [*recording_notes]  # drops the notes of earlier questions
        explanation = explain(evidence, name, kind)
        return {"lines": explanation.lines, "data": explanation.json_report}

    return answer


def broken_agent(error: BrokenAgentError, options: RunOptions) -> BrokenAgentError:
    """Return the error of a failed start with the findings of the check."""
    from cxbridge_studio.check.start_errors import add_findings  # noqa: PLC0415

    return add_findings(error, options)


def mistakes(options: RunOptions) -> Sequence[str]:
    """Return the errors that the check finds in the agents of a run that has started, each as a text."""
    from cxbridge_studio.check.findings import shorten_path  # noqa: PLC0415
    from cxbridge_studio.check.start_errors import find_errors  # noqa: PLC0415

    return [f"{shorten_path(finding)}" for finding in find_errors(options)]


def place_of_action(files: Sequence[Path], action: str) -> str:
    """Return the position ``FILE:LINE`` where an action is put into a plan; empty if no file names it."""
    from cxbridge_studio.explain.source_positions import SourcePositions  # noqa: PLC0415

    return SourcePositions(files).find_action_position(action)


def missing_events(agent: Run, failed_rules: Iterable[str]) -> str:
    """Return a text with the events that a stuck agent waits for; empty if time alone may activate a rule."""
    from cxbridge_studio.explain.timed_rules import has_timed_rule  # noqa: PLC0415

    if has_timed_rule(agent):
        return ""
    from cxbridge_studio.explain.missing_events import describe_missing_events  # noqa: PLC0415

    return describe_missing_events(agent, failed_rules)
