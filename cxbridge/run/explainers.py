"""The explainers: modules of plug-ins that find the reason of a failed goal, and the mistakes of an agent."""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, Final

from cxbridge.plugins import PluginError, Table, is_module, package_hint

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from cxbridge.errors import BrokenAgentError
    from cxbridge.run.options import RunOptions
    from cxbridge.trace.formats.base import Run

EXPLAINERS: Final[Table[ModuleType]] = Table(
    "EXPLAINERS", is_module, "a module with a function 'why', 'broken_agent' or 'places'"
)
"""The explainers. A module has one of the functions, or several."""


class Places:
    """Finds names in the files of an agent. Without a plug-in that reads the files, it finds none.

    A place is ``FILE:LINE``; empty when no file has it: a goal or an action may be made of variables.
    """

    def of_action(self, action: str) -> str:  # noqa: ARG002 - here and below: plug-ins use them
        """Return where plans get an action."""
        return ""

    def of_goal(self, goal_class: str, mode: str) -> str:  # noqa: ARG002
        """Return where a rule of the agent has brought goals of a class into a mode, or has made them."""
        return ""

    def of_interface(self, kind: str, name: str) -> str:  # noqa: ARG002
        """Return where rules open an interface."""
        return ""

    def of_similar_fact(self, template: str) -> str:  # noqa: ARG002
        """Return where a fact is asserted whose name may be a misspelt one: ``NAME, which PLACE asserts``."""
        return ""

    def rules_that_make_goals(self) -> list[str]:
        """Return the names of the rules that assert goals."""
        return []


def places(files: Sequence[Path]) -> Places:
    """Return what finds names in the CLIPS files of an agent: that of the first explainer that does."""
    for row in EXPLAINERS.rows:
        find = getattr(EXPLAINERS.load(row), "places", None)
        if find is not None:
            found: Places = find(files)
            return found
    return Places()


def why(run: Run, name: str) -> Sequence[str]:
    """Return why a goal of a recorded run came to its outcome, or why a rule did not fire.

    :param name: a goal's id, a class of goals, or a rule.
    :raises CxbridgeError: when the run has nothing of that name, or no plug-in explains runs.
    """
    for row in EXPLAINERS.rows:
        explain = getattr(EXPLAINERS.load(row), "why", None)
        if explain is not None:
            lines: Sequence[str] = explain(run, name)
            return lines
    raise PluginError("no installed package explains runs", hint=package_hint("why"))


def with_explanations(error: BrokenAgentError, options: RunOptions) -> BrokenAgentError:
    """Return the error about a broken agent with the explainers' findings; the error itself without any.

    :param options: of the run.
    """
    for row in EXPLAINERS.rows:
        explain = getattr(EXPLAINERS.load(row), "broken_agent", None)
        if explain is not None:
            error = explain(error, options)
    return error
