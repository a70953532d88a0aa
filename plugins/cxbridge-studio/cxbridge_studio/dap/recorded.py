"""A debugged recording, which is read-only and can be stepped forwards and backwards."""

from __future__ import annotations

import threading
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.clipstext.values import show_alone
from cxbridge.clock import MICROSECONDS
from cxbridge.errors import ClipsError, CxbridgeError
from cxbridge.events import Event, FactChange, RuleFired
from cxbridge.history.transitions import TRANSITION_TYPES, Transition
from cxbridge.suggestions import or_similar
from cxbridge_studio.dap.expressions import expand_known_variables
from cxbridge_studio.dap.target import DebugClient, FileLine, Firing, StoppedEnvironment, Target, TargetStop
from cxbridge_studio.debugger.breakpoints import Breakpoint, describe_transition
from cxbridge_studio.debugger.evaluating import Evaluation
from cxbridge_studio.debugger.names import OccurredNames
from cxbridge_studio.environment_sources import find_building_steps
from cxbridge_studio.explain.rules.constructs import Constructs, TextFile
from cxbridge_studio.explain.rules.matcher import FACT_FUNCTION, Matcher
from cxbridge_studio.explain.rules.recorded_facts import parse_rows
from cxbridge_studio.explain.rules.snapshot import MAX_FACTS, Snapshot
from cxbridge_studio.monitor.scrubbing import Scrubber

if TYPE_CHECKING:
    from cxbridge.executive.host.facts.copying import FactTemplate
    from cxbridge.trace.formats.base import Run
    from cxbridge_studio.recorded_state import RunState

_UNLIMITED_S: Final = 1e9  # no limit in practice: the recording is read to its end before the first stop
_CONSTRUCT_ROLES: Final = ("clips", "construct")  # the roles of recorded sources that have constructs
_STOP_TYPES: Final = (*TRANSITION_TYPES, RuleFired)  # events at which a recording can stop


@dataclass(frozen=True, slots=True)
class _RecordedSources:
    """The sources of an environment.

    :param constructs: the constructs of the files.
    :param texts: the texts of the files, by the names under which they were loaded.
    """

    constructs: Constructs
    texts: Mapping[str, str]

    @classmethod
    def from_run(cls, run: Run, env: str) -> _RecordedSources:
        """Read the sources of a recording."""
        steps = (step for step in find_building_steps(run, env) if step.role in _CONSTRUCT_ROLES)
        texts = {step.name: (step.data or b"").decode("utf-8", "surrogateescape") for step in steps}
        return cls(Constructs(TextFile(name, text) for name, text in texts.items()), texts)

    def find_rule_position(self, rule: str) -> FileLine | None:
        """Return the position of a rule, with the recorded text if the file has changed since."""
        name, line = self.constructs.read_rulebook().positions.get(rule, ("", 0))
        if not name:
            return None
        text, path = self.texts[name], Path(name)
        try:
            is_unchanged = path.read_bytes().decode("utf-8", "surrogateescape") == text
        except OSError:
            is_unchanged = False
        return FileLine(path.resolve(), line, None if is_unchanged else text)


class RecordedStoppedEnvironment(StoppedEnvironment):
    """The environment at a stop within a recording.

    :param retracted_facts: the facts that the last rule has retracted, by index.
    """

    def __init__(
        self,
        env: str,
        firing: Firing | None,
        event: Transition | None,
        state: RunState,
        retracted_facts: Mapping[int, FactChange],
        sources: _RecordedSources,
    ) -> None:
        super().__init__(env, firing, event)
        self._facts = state.facts.by_env.get(env, {})
        self._retracted = retracted_facts
        self._sources = sources

    def find_rule_position(self, rule: str) -> FileLine | None:
        return self._sources.find_rule_position(rule)

    def take_rule_snapshot(self, rule: str) -> Snapshot:
        return self._sources.constructs.take_snapshot(rule, self.agent, 0)

    def count_facts(self) -> Mapping[str, int]:
        return Counter(fact.template for fact in self._facts.values())

    def find_template(self, name: str) -> FactTemplate | None:
        """Return a deftemplate, derived from its facts if the sources lack it."""
        templates = self._sources.constructs.templates
        return templates.get(name) or parse_rows(self.read_facts(name), templates)[0].get(name)

    def read_facts(self, template: str) -> Sequence[FactChange]:
        return [fact for fact in self._facts.values() if fact.template == template]

    def find_fact(self, index: int) -> FactChange | None:
        return self._facts.get(index) or self._retracted.get(index)

    def has_function(self, name: str) -> bool:
        """Return whether a recorded file defines a function: a recording has no further functions."""
        return self._sources.constructs.has_function(name)

    def fact_expression(self, index: int) -> str:
        return f"({FACT_FUNCTION} {index})"

    def evaluate(self, expression: str) -> Evaluation:
        """Evaluate an expression on the facts of this stop, in a separate environment."""
        if len(self._facts) > MAX_FACTS:
            raise ClipsError(f"there are more than {MAX_FACTS} facts")
        templates, rows = parse_rows(self._facts.values(), self._sources.constructs.templates)
        with Matcher(Snapshot(self.agent, 0, "", templates, tuple(rows))) as matcher:
            value = matcher.evaluate(expression)
        return Evaluation("" if value is None else show_alone(value), ())


class RecordedRun(Target):
    """A debugged recording.

    :param env: the CLIPS environment; None for the first environment with a firing or a transition.
    :raises CxbridgeError: if there is no such environment.
    """

    can_go_back = True

    def __init__(self, run: Run, env: str | None = None) -> None:
        self._scrubber = scrubber = Scrubber(run)
        scrubber.load(_UNLIMITED_S)
        names = list(dict.fromkeys(event.env for event in scrubber.events if isinstance(event, _STOP_TYPES)))
        if not names or env not in (None, *names):
            raise CxbridgeError(
                f"{run.path} has no rules or transitions" + (f" of '{env}'" if env else ""),
                hint=f"the environments are {', '.join(names) or 'none'}",
            )
        self._env = env or names[0]
        self._sources = _RecordedSources.from_run(run, self._env)
        self._has_rules = any(isinstance(event, RuleFired) for event in scrubber.events)
        self._breakpoint_groups: dict[str, Mapping[int, Breakpoint]] = {}
        self._hit_counts: Counter[int] = Counter()
        self._next_move = ""  # the unit of a step, `continue`, `entry`, or empty while stopped
        self._is_backwards = False
        self._is_over = threading.Event()

    @property
    def agents(self) -> Sequence[str]:
        return [self._env]

    def run(self, client: DebugClient) -> int:
        """Step through the recording as the client requests; return the exit status 0."""
        for note in self._scrubber.notes:
            client.send_event("output", {"category": "console", "output": f"{note}\n"})
        client.send_event("thread", {"reason": "started", "threadId": 1})
        self._next_move = "entry"
        while not self._is_over.is_set():
            if (target_stop := self._move_to_stop(client)) is None:
                break
            self._next_move = ""
            client.serve_stop(target_stop, lambda: bool(self._next_move) or self._is_over.is_set())
        return 0

    def interrupt(self) -> None:
        self._is_over.set()

    def set_breakpoints(self, group: str, breakpoints: Mapping[int, Breakpoint]) -> None:
        self._breakpoint_groups[group] = breakpoints

    def go_on(self) -> None:
        self._next_move, self._is_backwards = "continue", False

    def step(self, unit: str) -> None:
        """Step to the next ``rule``, ``loop`` or ``transition``; steps within a rule are not recorded."""
        self._next_move, self._is_backwards = "rule" if unit == "line" else unit, False

    def pause(self) -> None:
        """Do nothing: a recording does not run by itself."""

    def go_back(self, unit: str) -> None:
        self._next_move, self._is_backwards = unit or "continue", True

    is_loaded = True

    def explain_no_stop(self, rule: str, file: Path) -> str:
        if not self._has_rules:
            return "no rules were recorded: record with --trace-level rules"
        if rule not in self._sources.constructs.read_rule_texts() and self._sources.texts:
            return f"the run had no rule {rule} of {file.name}"
        return ""

    def explain_unreachable(self, tested_breakpoint: Breakpoint) -> str:
        occurred_names = OccurredNames()
        for event in filter(self._is_stop_event, self._scrubber.events):
            if _is_hit(tested_breakpoint, event):
                return ""
            occurred_names.add_event(event)
        rules = self._sources.constructs.read_rule_texts()
        if not tested_breakpoint.is_rule_breakpoint:
            return (
                occurred_names.describe_missing_name(tested_breakpoint)
                or f"nothing in the recording reaches {tested_breakpoint}"
            )
        if any(map(tested_breakpoint.matches_rule, rules)):
            return ""  # the recording has the rule, which never fires
        name = tested_breakpoint.name
        return f"there is no rule '{name}' in the recording{or_similar(name, rules)}"

    def list_files(self) -> Iterator[Path]:
        yield from (Path(name).resolve() for name in self._sources.texts)

    # -- execution

    def _move_to_stop(self, client: DebugClient) -> TargetStop | None:
        """Move as the client requests, and return the next stop; None after the end of the recording."""
        if self._next_move == "entry":
            return self._stop_at_entry()
        events, direction = self._scrubber.events, -1 if self._is_backwards else 1
        # At a stop, the scrubber is behind the event of the stop: the index of the event is one less.
        event_index = self._scrubber.position - 1 + direction
        while 0 <= event_index < len(events) and not self._is_over.is_set():
            if self._is_stop_event(events[event_index]) and (stop := self._stop_at(event_index, client)):
                return stop
            event_index += direction
        if self._is_backwards:
            return self._stop_at_entry()
        if self._scrubber.position == len(events):
            return None
        self._scrubber.go_to(len(events))
        return self._stop_here("step", "at the end of the recording", None)

    def _stop_at_entry(self) -> TargetStop:
        events = self._scrubber.events
        event_index = next((index for index, event in enumerate(events) if self._is_stop_event(event)), 0)
        self._scrubber.go_to(event_index + 1)
        return self._stop_here("entry", self._describe_event(events[event_index]), events[event_index])

    def _is_stop_event(self, event: Event) -> bool:
        return isinstance(event, _STOP_TYPES) and event.env == self._env

    def _stop_at(self, event_index: int, client: DebugClient) -> TargetStop | None:
        """Return the stop at an event; None if the recording does not stop there."""
        event = self._scrubber.events[event_index]
        is_change = isinstance(event, RuleFired) or self._is_change(event_index)
        for breakpoints in self._breakpoint_groups.values() if is_change else ():
            for client_number, set_breakpoint in breakpoints.items():
                if _is_hit(set_breakpoint, event) and (
                    stop := self._count_hit(client_number, set_breakpoint, event_index, client)
                ):
                    return stop
        if self._ends_step(event, event_index):
            self._scrubber.go_to(event_index + 1)
            return self._stop_here("step", self._describe_event(event), event)
        return None

    def _is_change(self, event_index: int) -> bool:
        """Return whether a transition changes a state: a Skiller also repeats its status."""
        transitions = self._scrubber.transitions
        index = bisect_left(transitions, event_index + 1)
        return index < len(transitions) and transitions[index] == event_index + 1

    def _ends_step(self, event: Event, event_index: int) -> bool:
        if self._next_move == "rule":
            return isinstance(event, RuleFired) or not self._has_rules
        if self._next_move == "transition":
            return isinstance(event, TRANSITION_TYPES) and self._is_change(event_index)
        if self._next_move != "loop":
            return False
        # A loop begins with the first firing of a run of the rules; in a recording without firings, when the
        # time changes.
        if isinstance(event, RuleFired) or self._has_rules:
            return isinstance(event, RuleFired) and event.number == 1
        times = self._scrubber.times
        return event_index == 0 or times[event_index] != times[event_index - 1]

    def _count_hit(
        self, client_number: int, hit_breakpoint: Breakpoint, event_index: int, client: DebugClient
    ) -> TargetStop | None:
        """Return the stop at a breakpoint; None if its condition, hit count or log message prevents the stop.

        :param client_number: the client's number of the breakpoint.
        :param event_index: the index of the event in the recording.
        """
        self._scrubber.go_to(event_index + 1)
        event = self._scrubber.events[event_index]
        reason = "breakpoint" if hit_breakpoint.is_rule_breakpoint else "function breakpoint"
        target_stop = replace(
            self._stop_here(reason, self._describe_event(event), event), breakpoint=client_number
        )
        if hit_breakpoint.condition:
            try:
                if self._evaluate_text(target_stop.stopped_env, hit_breakpoint.condition) == "FALSE":
                    return None
            except CxbridgeError as error:
                text = f"{target_stop.description} (the condition fails: {error.message})"
                target_stop = replace(target_stop, description=text)
        self._hit_counts[client_number] += 1
        if not hit_breakpoint.is_due(self._hit_counts[client_number]):
            return None
        if hit_breakpoint.log:
            text = hit_breakpoint.format_log(
                lambda expression: self._evaluate_or_error(target_stop.stopped_env, expression)
            )
            client.send_event("output", {"category": "console", "output": f"{text}\n"})
            return None
        return target_stop

    @staticmethod
    def _evaluate_text(stopped_env: StoppedEnvironment, expression: str) -> str:
        return stopped_env.evaluate(expand_known_variables(expression, stopped_env)).text

    def _evaluate_or_error(self, stopped_env: StoppedEnvironment, expression: str) -> str:
        try:
            return self._evaluate_text(stopped_env, expression)
        except CxbridgeError as error:
            return f"{{{expression}: {error.message}}}"

    @staticmethod
    def _describe_event(event: Event) -> str:
        if isinstance(event, RuleFired):
            return f"before rule {event.rule}"
        return f"at {describe_transition(event)}" if isinstance(event, TRANSITION_TYPES) else ""

    def _stop_here(self, reason: str, description: str, event: Event | None) -> TargetStop:
        """Return a stop at the position of the scrubber."""
        scrubber = self._scrubber
        state, seconds = scrubber.state, scrubber.now_us / MICROSECONDS
        last_firing = state.rule if state.rule is not None and state.rule.env == self._env else None
        firing = None if last_firing is None else Firing(last_firing.rule, last_firing.basis)
        transition = event if isinstance(event, TRANSITION_TYPES) else None
        stopped_env = RecordedStoppedEnvironment(
            self._env, firing, transition, state, self._find_retracted_facts(), self._sources
        )
        return TargetStop(1, reason, f"Stopped {description} ({seconds:.3f} s)", stopped_env)

    def _find_retracted_facts(self) -> dict[int, FactChange]:
        """Return the facts that the current rule has retracted so far."""
        retracted_facts: dict[int, FactChange] = {}
        for event_index in range(self._scrubber.position - 1, -1, -1):
            event = self._scrubber.events[event_index]
            if isinstance(event, RuleFired) and event.env == self._env:
                break
            if isinstance(event, FactChange) and event.env == self._env and not event.asserted:
                retracted_facts[event.index] = event
        return retracted_facts


def _is_hit(tested_breakpoint: Breakpoint, event: Event) -> bool:
    if isinstance(event, RuleFired):
        return tested_breakpoint.is_rule_breakpoint and tested_breakpoint.matches_rule(event.rule)
    return (
        isinstance(event, TRANSITION_TYPES)
        and tested_breakpoint.is_transition_breakpoint
        and tested_breakpoint.matches_transition(event)
    )
