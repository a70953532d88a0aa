"""The explainers: modules of plug-ins that say why a goal failed, and what is wrong with a broken agent."""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, Final

from cxbridge.plugins import PluginError, Table, is_module, package_hint

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cxbridge.errors import BrokenAgentError
    from cxbridge.run.options import RunOptions
    from cxbridge.trace.formats.base import Run

EXPLAINERS: Final[Table[ModuleType]] = Table(
    "EXPLAINERS", is_module, "a module with a function 'why' or 'broken_agent'"
)
"""The explainers. A module has either function, or both."""


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
    """Return the error about a broken agent with what the explainers find; the error itself without any.

    :param options: of the run.
    """
    for row in EXPLAINERS.rows:
        explain = getattr(EXPLAINERS.load(row), "broken_agent", None)
        if explain is not None:
            error = explain(error, options)
    return error
