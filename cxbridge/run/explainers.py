"""Explainers of plug-ins: reasons of failed goals, and mistakes of agents."""

from __future__ import annotations

from contextlib import contextmanager
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final, NoReturn, Protocol

from cxbridge.errors import BrokenAgentError
from cxbridge.plugins import PluginError, Table, is_module, package_hint

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from cxbridge.run.options import RunOptions
    from cxbridge.trace.formats.base import Run

EXPLAINERS: Final[Table[ModuleType]] = Table(
    "EXPLAINERS", is_module, "a module with a function 'why', 'explainer', 'broken_agent' or 'places'"
)
"""Explainer modules, each with at least one of the functions."""


class Explainer(Protocol):
    """Answers questions about a recorded run at a moment, e.g. why a rule has not fired."""

    def __call__(self, kind: str, name: str) -> Mapping[str, Any]:
        """Return ``lines`` for people and ``data`` for programs.

        :param kind: ``rule``, ``goal``, ``action``, ``fact``, or ``run``, which has no name.
        :raises CxbridgeError: if the run has no object of this name.
        """


class Places:
    """Finds names in an agent's files. This base class finds none.

    A place is ``FILE:LINE``, or empty if no file spells the name out.
    """

    def of_action(self, action: str) -> str:  # noqa: ARG002 - here and below: plug-ins use the parameters
        """Return the place in a plan that uses an action."""
        return ""

    def of_goal(self, goal_class: str, mode: str) -> str:  # noqa: ARG002
        """Return the place of a rule that makes goals of a class, or modifies them into a mode."""
        return ""

    def of_interface(self, kind: str, name: str) -> str:  # noqa: ARG002
        """Return the place where rules open an interface."""
        return ""

    def of_similar_fact(self, template: str) -> str:  # noqa: ARG002
        """Return the fact with the most similar name, and the place that asserts it.

        The text is ``NAME, which PLACE asserts``.
        """
        return ""

    def rules_that_make_goals(self) -> list[str]:
        """Return the rules that assert goals."""
        return []


def _functions(name: str) -> Iterator[Callable[..., Any]]:
    """Yield the functions with a name of all explainer modules that have the function."""
    modules = map(EXPLAINERS.load, EXPLAINERS.rows)
    return (getattr(module, name) for module in modules if hasattr(module, name))


def places(files: Sequence[Path]) -> Places:
    """Return the finder of the first explainer with a function ``places``, or a finder that finds nothing."""
    find: Callable[..., Places] = next(_functions("places"), lambda _files: Places())
    return find(files)


def why(run: Run, name: str) -> Sequence[str]:
    """Return why a recorded goal ended as it did, or why a rule did not fire.

    :param name: a goal id, a goal class or a rule.
    :raises CxbridgeError: if the run lacks the name, or no plug-in explains runs.
    """
    lines: Sequence[str] = next(_functions("why"), _refuse)(run, name)
    return lines


def explainer(run: Run, at_s: float | None = None, env: str | None = None) -> Explainer:
    """Return an explainer of a recorded run, which reads the run once.

    :param at_s: the moment, seconds since the start of the run; None: its end.
    :param env: the CLIPS environment; None: the executive's, or the only one.
    :raises CxbridgeError: if the run cannot be read, or no plug-in explains runs.
    """
    made: Explainer = next(_functions("explainer"), _refuse)(run, at_s, env)
    return made


def _refuse(*_arguments: object) -> NoReturn:
    raise PluginError("no installed package explains runs", hint=package_hint("why"))


@contextmanager
def explained(options: RunOptions) -> Iterator[None]:
    """Extend a :class:`BrokenAgentError` of the block by the findings of the explainers."""
    try:
        yield
    except BrokenAgentError as error:
        raise with_explanations(error, options) from None


def with_explanations(error: BrokenAgentError, options: RunOptions) -> BrokenAgentError:
    """Return the error, extended by the explainers' findings."""
    for explain in _functions("broken_agent"):
        error = explain(error, options)
    return error
