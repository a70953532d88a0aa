"""Calls of explainers: modules of plug-ins that explain runs and mistakes of agents.

An explainer module has one or several functions, which docs/plugins.md lists. A function of this module calls
the function of the first explainer that has it; :func:`with_explanations` calls those of all explainers. A
module is imported when a call first looks for a function in it.
"""

from __future__ import annotations

from contextlib import contextmanager
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final, NoReturn, Protocol, TypeVar

from cxbridge.errors import BrokenAgentError
from cxbridge.plugins import PluginError, Table, is_module, package_hint

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from cxbridge.run.agent import Run
    from cxbridge.run.options import RunOptions
    from cxbridge.trace.formats.base import Run as RecordedRun

T = TypeVar("T")

EXPLAINERS: Final[Table[ModuleType]] = Table(
    "EXPLAINERS",
    is_module,
    "a module with a function 'why', 'explainer', 'broken_agent', 'mistakes', 'place_of_action' or "
    "'missing_events'",
)
"""Explainer modules, each with at least one of the functions."""


class RunExplainer(Protocol):
    """Answers questions about a recorded run at a moment, e.g. why a rule has not fired."""

    def __call__(self, kind: str, name: str) -> Mapping[str, Any]:
        """Return ``lines`` for people and ``data`` for programs.

        :param kind: ``rule``, ``goal``, ``action``, ``fact``, or ``run``, which has no name.
        :raises CxbridgeError: if the run has no object of this name.
        """


def _find_functions(name: str) -> Iterator[Callable[..., Any]]:
    """Yield the functions of this name, from the explainer modules that have one."""
    modules = map(EXPLAINERS.load_target, EXPLAINERS.rows)
    return (getattr(module, name) for module in modules if hasattr(module, name))


def _call_first(name: str, default: T, *arguments: object) -> T:
    """Call the first function of this name and return its result; the default if no explainer has one."""
    function = next(_find_functions(name), None)
    result: T = default if function is None else function(*arguments)
    return result


def mistakes(options: RunOptions) -> Sequence[str]:
    """Return the mistakes in an agent's files with which a run can start; empty without a plug-in.

    :param options: the options of a run that has started.
    """
    return _call_first("mistakes", (), options)


def place_of_action(files: Sequence[Path], action: str) -> str:
    """Return the place in CLIPS files that puts an action into a plan, ``FILE:LINE``.

    The text is empty if no file spells the name out, or no plug-in finds the place.
    """
    return _call_first("place_of_action", "", files, action)


def missing_events(agent: Run, failed_rules: Iterable[str]) -> str:
    """Return a text with the events that a stuck agent waits for.

    The text is empty if time alone may activate a rule, or no plug-in can tell.

    :param agent: an idle agent: its agenda is empty, and no other program can write to it.
    :param failed_rules: rules that ended with an error.
    """
    return _call_first("missing_events", "", agent, failed_rules)


def why(run: RecordedRun, name: str) -> Sequence[str]:
    """Return why a recorded goal ended as it did, or why a rule did not fire.

    :param name: a goal id, a goal class or a rule.
    :raises CxbridgeError: if the run lacks the name, or no plug-in explains runs.
    """
    lines: Sequence[str] = next(_find_functions("why"), _raise_no_explainer)(run, name)
    return lines


def make_explainer(run: RecordedRun, at_s: float | None = None, env: str | None = None) -> RunExplainer:
    """Return an explainer of a recorded run, which reads the run once.

    :param at_s: the moment, seconds since the start of the run; None: its end.
    :param env: the CLIPS environment; None: the executive's, or the only one.
    :raises CxbridgeError: if the run cannot be read, or no plug-in explains runs.
    """
    run_explainer: RunExplainer = next(_find_functions("explainer"), _raise_no_explainer)(run, at_s, env)
    return run_explainer


def _raise_no_explainer(*_arguments: object) -> NoReturn:
    """Raise the error that names the package with explainers. Called in place of an explainer's function."""
    raise PluginError("no installed package explains runs", hint=package_hint("why"))


@contextmanager
def explaining_mistakes(options: RunOptions) -> Iterator[None]:
    """Extend a :class:`BrokenAgentError` of the block by the findings of the explainers."""
    try:
        yield
    except BrokenAgentError as error:
        raise with_explanations(error, options) from None


def with_explanations(error: BrokenAgentError, options: RunOptions) -> BrokenAgentError:
    """Return the error, extended by the explainers' findings."""
    for explain in _find_functions("broken_agent"):
        error = explain(error, options)
    return error
