"""An agent of a debugged run: its debugger, its breakpoints, and its state while its rules are stopped."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from clips._clips import lib

from cxbridge.clipstext.syntax import rule_lines
from cxbridge.events import Event, FactChange, RuleFired
from cxbridge.executive.host.capi import NULL, decode, encode
from cxbridge.executive.host.facts.copying import FactTemplate, template_of
from cxbridge_studio.dap.probes import Probes
from cxbridge_studio.debugger.agenda import read_activations
from cxbridge_studio.debugger.debugger import debugger_of
from cxbridge_studio.debugger.fact_editing import modify_fact

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.run.agent import Run
    from cxbridge_studio.debugger.breakpoints import Breakpoint, Stop


@dataclass(frozen=True, slots=True)
class FileLine:
    """A line of a file.

    :param line: the number of the line, from 1.
    """

    file: Path
    line: int


@dataclass(frozen=True, slots=True)
class Firing:
    """A rule that fires next, fires now, or has fired last.

    :param basis: the facts that match the rule's condition, in the notation of the agenda: ``f-1,*``.
    :param line: the line of the next action; 0 outside of the right-hand side.
    """

    rule: str
    basis: str
    line: int = 0


class DebuggedAgent:
    """An agent of the run.

    :param can_stop_at_actions: whether the agent can stop within right-hand sides.
    """

    def __init__(self, run: Run, *, can_stop_at_actions: bool) -> None:
        self.run = run
        self.debugger = debugger_of(run.executive)
        self.env: ClipsEnvironment = run.executive.env
        self.probes = Probes(self.env, self.debugger) if can_stop_at_actions else None
        # the client's numbers of breakpoints, by the debugger's numbers
        self.client_numbers: dict[int, int] = {}
        # the debugger's numbers of the breakpoints, by group
        self._breakpoint_groups: dict[str, list[int]] = {}
        self.last_firing: RuleFired | None = None
        # the facts that the firing rule has retracted, by index
        self.retracted_facts: dict[int, FactChange] = {}
        self._positions: dict[str, FileLine] = {}  # by rule
        self._read_file_count = 0  # the number of loaded files whose rules are in `_positions`
        run.bus.subscribe(self._record, RuleFired, FactChange)
        self._is_watch_renewed = False
        self._watch_rules_and_facts()

    def _watch_rules_and_facts(self) -> None:
        self.env.watcher.rules.set((), on=True)
        self.env.watcher.facts.set((), on=True)

    def renew_watch(self) -> None:
        """Watch rules and facts again, once: the agent's configuration may have turned them off."""
        if not self._is_watch_renewed:
            self._is_watch_renewed = True
            self._watch_rules_and_facts()

    def raise_error(self) -> None:
        """Raise the error that occurred while a right-hand side was stopped, if any."""
        if self.probes is not None and self.probes.error is not None:
            raise self.probes.error

    def set_breakpoints(self, group: str, breakpoints: Mapping[int, Breakpoint]) -> None:
        """Replace the breakpoints of a group.

        :param breakpoints: the breakpoints by the client's numbers.
        """
        for number in self._breakpoint_groups.pop(group, ()):
            self.debugger.remove(number)
            self.client_numbers.pop(number)
        # unchecked, since an unreachable breakpoint is no error: the adapter shows it as not verified
        new_client_numbers = {
            self.debugger.add(new_breakpoint, checked=False).number: client_number
            for client_number, new_breakpoint in breakpoints.items()
        }
        self.client_numbers |= new_client_numbers
        self._breakpoint_groups[group] = list(new_client_numbers)

    def _record(self, event: Event) -> None:
        """Record the rule that fires, and the facts that it retracts."""
        if isinstance(event, RuleFired) and event.env == self.env.name:
            self.last_firing = event
            self.retracted_facts.clear()
        elif isinstance(event, FactChange) and event.env == self.env.name and not event.asserted:
            self.retracted_facts[event.index] = event

    def find_rule_position(self, rule: str) -> FileLine | None:
        """Return the position of a rule in the last loaded file that defines it; None if no file does."""
        # read only the files that have been loaded since the last call
        files = self.env.loader.files
        for file in files[self._read_file_count :]:
            with suppress(OSError):  # the file may have been removed since it was loaded
                text, path = file.read_bytes().decode("utf-8", "surrogateescape"), file.resolve()
                self._positions |= {name: FileLine(path, line) for name, line in rule_lines(text).items()}
        self._read_file_count = len(files)
        return self._positions.get(rule)


class StoppedEnvironment:
    """The environment of an agent whose rules are stopped.

    :ivar firing: the current rule; None if the stop concerns no next rule, and no rule has fired yet.
    :ivar event: the transition that caused the stop; None if the stop has another cause.
    """

    def __init__(self, agent: DebuggedAgent, stop: Stop) -> None:
        last_firing, next_activation = agent.last_firing, next(read_activations(agent.env), None)
        # a stop within or after a rule and a stop at a transition are about the rule that fires or has fired
        # last; any other stop is about the next rule
        if stop.line or stop.event is not None or stop.kind == "after" or next_activation is None:
            self.firing = (
                None if last_firing is None else Firing(last_firing.rule, last_firing.basis, stop.line)
            )
        else:
            _, rule, basis = next_activation
            self.firing = Firing(rule, basis)
        self.agent = agent
        self.env = agent.env
        self.event = stop.event
        # the new indices of the facts that the client has changed during the stop, by their previous indices
        self._changed_indices: dict[int, int] = {}

    def find_template(self, name: str) -> FactTemplate | None:
        """Return a deftemplate; None if there is none of this name."""
        pointer = lib.FindDeftemplate(self.env.c_env, encode(name))
        return None if pointer == NULL else template_of(pointer)

    def read_facts(self, template: str) -> Sequence[FactChange]:
        """Return the facts of a deftemplate; empty if the deftemplate is unknown."""
        if not self.env.has_template(template):
            return ()
        indices = [index for index, _, _ in self.env.facts(template)]
        return [fact for fact in map(self.find_fact, indices) if fact is not None]

    def find_fact(self, index: int) -> FactChange | None:
        """Return the fact with an index, or the fact that the current rule has retracted.

        Return None if there is no such fact.
        """
        pointer = self.env.maker.find_fact(index)
        if pointer == NULL:
            return self.agent.retracted_facts.get(index)
        template = decode(lib.DeftemplateName(lib.FactDeftemplate(pointer)))
        text = self.env.watcher.fact_text(pointer)
        # the time of the assertion is unknown
        return FactChange(0, self.env.name, asserted=True, index=index, template=template, text=text)

    def find_latest(self, fact: FactChange) -> FactChange:
        """Return the fact that has replaced a fact through changes by the client; else the fact itself.

        Each change of a fact makes a new fact with another index.
        """
        index = fact.index
        while index in self._changed_indices:
            index = self._changed_indices[index]
        return self.find_fact(index) or fact

    def modify(self, index: int, slot: str, text: str) -> None:
        """Set a slot of a fact.

        :param text: the value as CLIPS text.
        :raises CxbridgeError: if the fact or the slot does not exist, or the value is invalid.
        """
        self._changed_indices[index] = modify_fact(self.env, index, {slot: text})
