"""The debugged target: a run or a recording, and its state while it is stopped."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from cxbridge.errors import CxbridgeError

if TYPE_CHECKING:
    from cxbridge.clipstext.values import Value
    from cxbridge.events import FactChange
    from cxbridge.executive.breakpoints import Breakpoint
    from cxbridge.executive.host.evaluating import Evaluation
    from cxbridge.executive.host.facts.copying import FactTemplate
    from cxbridge.history.transitions import Transition
    from cxbridge_studio.dap.protocol import ProtocolObject
    from cxbridge_studio.explain.rules.snapshot import Snapshot


@dataclass(frozen=True, slots=True)
class FileLine:
    """A line of a file.

    :param file: its path.
    :param line: from 1.
    :param text: the text, when it differs from the file on the disk; else None.
    """

    file: Path
    line: int
    text: str | None = None


@dataclass(frozen=True, slots=True)
class Firing:
    """A rule that fires next, fires now, or has fired last.

    :param basis: its facts, as the agenda shows them: ``f-1,*``.
    :param line: of the action that is next; 0: none has been carried out, or all have.
    """

    rule: str
    basis: str
    line: int = 0


class StoppedEnvironment(ABC):
    """A CLIPS environment at rest.

    :param agent: name of the agent.
    :param firing: the rule that it is about; None when there is none.
    :param event: the transition that it is stopped at, if it is.
    """

    def __init__(self, agent: str, firing: Firing | None, event: Transition | None) -> None:
        self.agent = agent
        self.firing = firing
        self.event = event
        self.changed: dict[int, int] = {}
        """The new indices of facts that were changed at this moment, by those before."""

    @abstractmethod
    def place(self, rule: str) -> FileLine | None:
        """Return the source place of a rule; None when unknown."""

    @abstractmethod
    def bare(self, rule: str) -> Snapshot:
        """Return a rule without facts.

        :raises CxbridgeError: when it is not known.
        """

    @abstractmethod
    def templates(self) -> Mapping[str, int]:
        """Return how many facts there are, by their deftemplates."""

    @abstractmethod
    def template(self, name: str) -> FactTemplate | None:
        """Return a deftemplate; None when it is not known."""

    @abstractmethod
    def facts(self, template: str) -> Sequence[FactChange]:
        """Return the facts of a deftemplate."""

    @abstractmethod
    def fact(self, index: int) -> FactChange | None:
        """Return a fact, also one that the rule has just retracted; None when it is not known."""

    def agenda(self) -> Sequence[tuple[int, str, str]] | None:
        """Return salience, rule and facts of what would fire, in order; None when that is not known."""
        return None

    def locals(self) -> Mapping[str, Value] | None:
        """Return the variables of the right-hand side that it is in; None when it is in none."""
        return None

    @abstractmethod
    def is_function(self, name: str) -> bool:
        """Whether CLIPS has a function of this name."""

    @abstractmethod
    def evaluate(self, expression: str) -> Evaluation:
        """Evaluate an expression.

        :raises CxbridgeError: when that fails.
        """

    def written(self, fact: int) -> str:
        """Return a fact as expressions for :meth:`evaluate` name it: CLIPS takes an index for a fact."""
        return str(fact)

    def modify(self, index: int, slot: str, text: str) -> int:
        """Give a slot of a fact another value; returns the index of the new fact.

        :raises CxbridgeError: when that is not possible.
        """
        raise CxbridgeError(f"slot {slot} of f-{index} cannot become {text}: this is a recording")


@dataclass(frozen=True, slots=True)
class Stopped:
    """A target has stopped.

    :param agent: the number of the agent, from 1.
    :param reason: as the protocol names it.
    :param breakpoint: its number; 0 for none.
    """

    agent: int
    reason: str
    description: str
    moment: StoppedEnvironment
    breakpoint: int = 0


class DebugClient(Protocol):
    """The other side, as targets see it."""

    def pump(self) -> None:
        """Carry out the waiting requests."""

    def stay(self, stopped: Stopped, is_over: Callable[[], bool]) -> None:
        """Carry out requests until one continues the run.

        :param is_over: whether there is nothing to wait for any more.
        """

    def send_event(self, name: str, body: Mapping[str, object] | ProtocolObject | None = None) -> None:
        """Send an event."""


class Target(ABC):
    """The debugged target. The serving thread calls all methods but :meth:`interrupt`."""

    can_go_back = False
    """Whether it can be stepped backwards."""

    can_stop_at_actions = False
    """Whether it can stop within right-hand sides."""

    @property
    @abstractmethod
    def agents(self) -> Sequence[str]:
        """The names of the agents: one is a thread of the protocol."""

    @abstractmethod
    def run(self, client: DebugClient) -> int:
        """Run to the end; returns the exit status.

        :raises CxbridgeError: when it cannot be run.
        """

    @abstractmethod
    def interrupt(self) -> None:
        """End it as soon as possible; from any thread."""

    @abstractmethod
    def set_breakpoints(self, group: str, wanted: Mapping[int, Breakpoint]) -> None:
        """Put breakpoints, by their numbers, in the place of those of this group."""

    @abstractmethod
    def go_on(self) -> None:
        """Continue to the next breakpoint."""

    @abstractmethod
    def step(self, unit: str) -> None:
        """Continue for a ``rule``, a ``loop``, a ``transition`` or a ``line``."""

    @abstractmethod
    def pause(self) -> None:
        """Stop as soon as possible."""

    def go_back(self, unit: str) -> None:
        """Go back: to the last breakpoint (empty), or a step.

        :raises CxbridgeError: when it cannot.
        """
        raise CxbridgeError(f"a run cannot go back{unit and f' a {unit}'}")

    @property
    @abstractmethod
    def is_loaded(self) -> bool:
        """Whether it is known which rules there are."""

    @abstractmethod
    def why_not(self, rule: str, file: Path) -> str:
        """Return why a rule of a file cannot stop, among the loaded ones; empty when it can."""

    @abstractmethod
    def why_never(self, item: Breakpoint) -> str:
        """Return why no loaded rule ever reaches a breakpoint; empty when one may."""

    @abstractmethod
    def files(self) -> Iterator[Path]:
        """Yield the files with rules that were loaded."""
