"""The interface of debug targets, which are runs and recordings, and of their state during a stop."""

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
    from cxbridge.executive.host.facts.copying import FactTemplate
    from cxbridge.history.transitions import Transition
    from cxbridge_studio.dap.protocol import ProtocolObject
    from cxbridge_studio.debugger.breakpoints import Breakpoint
    from cxbridge_studio.debugger.evaluating import Evaluation
    from cxbridge_studio.explain.rules.snapshot import Snapshot


@dataclass(frozen=True, slots=True)
class FileLine:
    """A line of a file.

    :param line: the number of the line, from 1.
    :param text: the recorded text of the file if the file has changed since the recording; else None.
    """

    file: Path
    line: int
    text: str | None = None


@dataclass(frozen=True, slots=True)
class Firing:
    """A rule that fires next, fires now, or has fired last.

    :param basis: the facts that match the rule's condition, in the notation of the agenda: ``f-1,*``.
    :param line: the line of the next action; 0 outside of the right-hand side.
    """

    rule: str
    basis: str
    line: int = 0


class StoppedEnvironment(ABC):
    """A stopped CLIPS environment.

    :param agent: the name of the agent.
    :param firing: the current rule; None between two loops.
    :param event: the transition that caused the stop; None if the stop has another cause.
    """

    def __init__(self, agent: str, firing: Firing | None, event: Transition | None) -> None:
        self.agent = agent
        self.firing = firing
        self.event = event
        # the new indices of the facts that the client has changed during the stop, by their previous indices
        self.changed_indices: dict[int, int] = {}

    @abstractmethod
    def find_rule_position(self, rule: str) -> FileLine | None:
        """Return the position of a rule in a file; None if the position is unknown."""

    @abstractmethod
    def take_rule_snapshot(self, rule: str) -> Snapshot: ...

    @abstractmethod
    def count_facts(self) -> Mapping[str, int]:
        """Return the number of facts by deftemplate."""

    @abstractmethod
    def find_template(self, name: str) -> FactTemplate | None:
        """Return a deftemplate; None if there is none of this name."""

    @abstractmethod
    def read_facts(self, template: str) -> Sequence[FactChange]: ...

    @abstractmethod
    def find_fact(self, index: int) -> FactChange | None:
        """Return the fact with an index, even if the current rule has retracted it, or None."""

    def read_agenda(self) -> Sequence[tuple[int, str, str]] | None:
        """Return the salience, rule and facts of each activation in order; None if the agenda is unknown."""
        return None

    def read_local_variables(self) -> Mapping[str, Value] | None:
        """Return the variables of the stopped right-hand side; None outside of right-hand sides."""
        return None

    @abstractmethod
    def has_function(self, name: str) -> bool: ...

    @abstractmethod
    def evaluate(self, expression: str) -> Evaluation: ...

    def fact_expression(self, index: int) -> str:
        """Return the expression for a fact in :meth:`evaluate`. CLIPS accepts the index as a fact."""
        return str(index)

    def modify(self, index: int, slot: str, text: str) -> int:
        """Set a slot of a fact and return the index of the new fact.

        :raises CxbridgeError: if facts are read-only or the value is invalid.
        """
        raise CxbridgeError(f"slot {slot} of f-{index} cannot be set to {text}: this is a recording")


@dataclass(frozen=True, slots=True)
class TargetStop:
    """A stop of a target.

    :param agent: the number of the agent, from 1.
    :param reason: the protocol's name of the reason.
    :param stopped_env: the state of the agent.
    :param breakpoint: the client's number of the breakpoint; 0 without a breakpoint.
    """

    agent: int
    reason: str
    description: str
    stopped_env: StoppedEnvironment
    breakpoint: int = 0


class DebugClient(Protocol):
    """The interface of a client that a target uses."""

    def handle_queued_requests(self) -> None:
        """Execute the queued requests."""

    def serve_stop(self, target_stop: TargetStop, is_over: Callable[[], bool]) -> None:
        """Execute requests until a request resumes the run.

        :param is_over: returns whether the stop is over.
        """

    def send_event(self, name: str, body: Mapping[str, object] | ProtocolObject | None = None) -> None: ...


class Target(ABC):
    """A debug target. The serving thread calls all methods except :meth:`interrupt`."""

    can_go_back = False  # whether the target can be stepped backwards

    can_stop_at_actions = False  # whether the target can stop within right-hand sides

    @property
    @abstractmethod
    def agents(self) -> Sequence[str]:
        """The names of the agents. Each agent is a thread of the protocol."""

    @abstractmethod
    def run(self, client: DebugClient) -> int:
        """Run to the end and return the exit status.

        :raises CxbridgeError: if the target cannot run.
        """

    @abstractmethod
    def interrupt(self) -> None:
        """End the target as soon as possible. Any thread may call this."""

    @abstractmethod
    def set_breakpoints(self, group: str, breakpoints: Mapping[int, Breakpoint]) -> None:
        """Replace the breakpoints of a group, given by number."""

    @abstractmethod
    def go_on(self) -> None:
        """Resume until the next breakpoint."""

    @abstractmethod
    def step(self, unit: str) -> None:
        """Resume until the next ``rule``, ``loop``, ``transition`` or ``line``."""

    @abstractmethod
    def pause(self) -> None:
        """Stop as soon as possible."""

    def go_back(self, unit: str) -> None:
        """Go back to the previous breakpoint (empty unit) or by one step.

        :raises CxbridgeError: if the target cannot go back.
        """
        raise CxbridgeError(f"a run cannot go back{unit and f' a {unit}'}")

    @property
    @abstractmethod
    def is_loaded(self) -> bool:
        """Whether the rules of the target are known."""

    @abstractmethod
    def explain_no_stop(self, rule: str, file: Path) -> str:
        """Return why the target cannot stop at a rule of a file; empty if the target can stop there."""

    @abstractmethod
    def explain_unreachable(self, tested_breakpoint: Breakpoint) -> str:
        """Return why no loaded rule can reach a breakpoint; empty if a rule can."""

    @abstractmethod
    def list_files(self) -> Iterator[Path]:
        """Yield the loaded CLIPS files."""
