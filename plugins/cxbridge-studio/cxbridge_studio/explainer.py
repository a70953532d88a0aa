"""The studio's module in the table of explainers (docs/plugins.md).

The core calls these functions when a run fails or is explained. Each function imports the parts of the studio
that it needs, because most calls need only one part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cxbridge.errors import BrokenAgentError
from cxbridge.run.explainers import Explainer, Places
from cxbridge.run.options import RunOptions
from cxbridge.trace.formats.base import Run


def why(run: Run, name: str) -> Sequence[str]:
    """Return the lines that explain the outcome of a goal, or why a rule did not fire."""
    from cxbridge_studio.explain.answer import explain  # noqa: PLC0415 - see the docstring of the module
    from cxbridge_studio.explain.recorded import RecordedEvidence  # noqa: PLC0415

    return explain(RecordedEvidence(run, None, None), name).lines


def explainer(run: Run, at_s: float | None, env: str | None) -> Explainer:
    """Return the function that answers questions about a recorded run at a moment.

    :param at_s: the moment in seconds since the start of the run; None for the end.
    :param env: the CLIPS environment; None for the executive's.
    """
    from cxbridge_studio.explain.answer import explain  # noqa: PLC0415
    from cxbridge_studio.explain.recorded import RecordedEvidence  # noqa: PLC0415

    evidence = RecordedEvidence(run, at_s, env)
    notes_of_source = [*evidence.notes]

    def answer(kind: str, name: str) -> Mapping[str, Any]:
        evidence.notes = [*notes_of_source]  # drops the notes of earlier questions
        explanation = explain(evidence, name, kind)
        return {"lines": explanation.lines, "data": explanation.plain}

    return answer


def broken_agent(error: BrokenAgentError, options: RunOptions) -> BrokenAgentError:
    """Return the error of a failed start with the findings of the check."""
    from cxbridge_studio.check.start_errors import with_findings  # noqa: PLC0415

    return with_findings(error, options)


def places(files: Sequence[Path]) -> Places:
    """Return the finder of the positions of names in an agent's files."""
    from cxbridge_studio.explain.places import SourcePlaces  # noqa: PLC0415

    return SourcePlaces(files)
