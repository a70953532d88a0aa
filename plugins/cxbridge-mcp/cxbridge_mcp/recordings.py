"""The tools for files: scenarios, recordings and their contents."""

from __future__ import annotations

from typing import Any, Final, Literal

import cxbridge as cx
from cxbridge.printing import visible
from cxbridge_mcp.commands import run_command
from cxbridge_mcp.folders import Folders

# Limits of answers, because the context of a language model is limited.
MAX_ROWS: Final = 200
"""The maximum number of rows in an answer."""

MAX_CHARACTERS: Final = 60_000
"""The maximum number of characters of a text in an answer."""

_CHECK_TIMEOUT_S: Final = 120.0  # chosen freely


def clean_answer(text: str) -> str:
    """Return a text without control characters, cut to the maximum length of an answer."""
    text = visible(text)
    if len(text) <= MAX_CHARACTERS:
        return text
    return f"{text[:MAX_CHARACTERS]}\n... {len(text) - MAX_CHARACTERS} more characters are omitted"


class RecordingTools:
    """The tools for scenarios and recordings. Lists have at most `MAX_ROWS` rows.

    The docstrings of the tools are the descriptions that the assistant reads.

    :param folders: the files that the assistant may name.
    """

    def __init__(self, folders: Folders) -> None:
        self._folders = folders

    def list_scenarios(self) -> list[str]:
        """List the agents that can be checked: shipped scenarios by name, other scenarios by folder."""
        return self._folders.list_scenarios()[:MAX_ROWS]

    def list_recordings(self) -> list[dict[str, Any]]:
        """List the recordings of runs, the newest first, with format and size."""
        return self._folders.list_recordings()[:MAX_ROWS]

    def goal_tree(self, recording: str) -> dict[str, Any]:
        """Return the result of a recorded run, and the tree of its goals with modes, outcomes and errors."""
        run = cx.open_run(self._folders.recording_path(recording))
        return {
            "status": run.status,
            "reason": run.reason,
            "seconds": run.seconds,
            "goals": len(run.goals),
            "tree": clean_answer(str(run)),
        }

    def why_in_recording(self, recording: str, name: str) -> str:
        """Explain the outcome of a goal of a recorded run, or why a rule did not fire.

        :param name: a goal's id, a class of goals (CLASS#2 for its second goal), or a rule. A rule needs a
            recording with facts.
        """
        return clean_answer(cx.open_run(self._folders.recording_path(recording)).why(name))

    def compare_recordings(
        self, first: str, second: str, order: Literal["partial", "total"] = "partial"
    ) -> dict[str, Any]:
        """Compare the transitions of goals and plan-actions of two recorded runs.

        :param order: partial compares the order of each goal's transitions, total the order of all
            transitions.
        """
        first_run, second_run = (cx.open_run(self._folders.recording_path(name)) for name in (first, second))
        comparison = first_run.compare(second_run, order=order)
        rows = comparison.differences[:MAX_ROWS]
        return {
            "same": comparison.same,
            "transitions": [comparison.count_a, comparison.count_b],
            "differences": [
                {"what": row.what, "subject": row.subject, "first": row.a.text, "second": row.b.text}
                for row in rows
            ],
            "more_differences": len(comparison.differences) - len(rows),
            "hints": comparison.hints,
        }

    async def check_agent(self, scenario: str) -> str:
        """Find the mistakes of an agent without running it: each with file, line, code and remedy."""
        command = ["check", self._folders.scenario_argument(scenario), "--format", "text"]
        status, output = await run_command(*command, timeout_s=_CHECK_TIMEOUT_S)
        return clean_answer(output) or ("no mistakes" if status == 0 else "there are mistakes")
