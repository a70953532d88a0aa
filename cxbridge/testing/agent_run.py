"""A run under the control of a test: cycles run only when the test advances the clock.

Mistakes of the agent and errors in rules become an :class:`AssertionError`, the latter with the goals so far.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from itertools import groupby
from typing import Any, Final, NamedTuple

from cxbridge.clock import MICROSECONDS
from cxbridge.closing import Closing
from cxbridge.errors import BrokenAgentError
from cxbridge.event_kinds import View
from cxbridge.events import Event, GoalTransition, Level, LogLine, PlanActionTransition, RuleFired
from cxbridge.history.builder import UNLIMITED, RunHistory
from cxbridge.history.model import GoalRecord, PlanActionRecord, find_goals, goal_tree
from cxbridge.history.transitions import TRANSITION_TYPES, Transition
from cxbridge.history.tree import latest_lines
from cxbridge.mainloop import Hook
from cxbridge.printing import indent_lines
from cxbridge.run.agent import Run
from cxbridge.run.explainers import with_explanations
from cxbridge.run.mistakes import AgentChecks
from cxbridge.run.options import RunOptions
from cxbridge.run.recording import start_recording
from cxbridge.run.stuck import RULE_ERROR_CODE
from cxbridge.run.watchdog import make_spin_watchdog
from cxbridge.suggestions import bracketed_suggestion
from cxbridge.testing.golden import GoldenFiles
from cxbridge.testing.members import find_member
from cxbridge.testing.scripted import ScriptedSkillers
from cxbridge.testing.skills import check_number
from cxbridge.testing.world import World
from cxbridge.trace.compare.model import Order, parse_choice

PATIENCE_S: Final = 60.0
"""The default limit of a wait in seconds of real time, for agents whose rules fire forever."""

_MAX_RULES = 10  # the maximum number of rules in the report of a failure
_MAX_LINES = 15  # the maximum number of log lines, and of skill calls, in the report of a failure


class _TimedAction(NamedTuple):
    """A function of the test, and the time from which it is called, by the run's clock."""

    time_us: int
    action: Callable[[], object]


class AgentRun(World, Closing):
    """A run whose clock advances only while the test runs cycles; a context manager.

    The constructor loads the agent and runs no cycle: rules have fired only if the agent runs them during
    loading.

    :param options: the options of ``cxbridge run``.
    :param scripted: whether the script :attr:`skills` executes the skills instead of ``options.skiller``.
    :param strict: whether mistakes in the loaded files raise an error.
    :param patience: the limit of each wait, in seconds of real time.
    :param golden: the golden files for `assert_golden`; None if the run has none.
    :ivar log: the lines of the log, in order.
    :ivar rules: the last fired rules, in order.
    :ivar transitions: the transitions of goals, plan-actions and skills, in order.
    :raises CxbridgeError: if the scenario is invalid.
    :raises AssertionError: if the agent has mistakes.
    """

    def __init__(
        self,
        options: RunOptions,
        *,
        scripted: bool,
        strict: bool = True,
        patience: float = PATIENCE_S,
        golden: GoldenFiles | None = None,
    ) -> None:
        self.options, self.patience, self._golden = options, patience, golden
        self.log: list[LogLine] = []
        self.rules: deque[str] = deque(maxlen=_MAX_RULES)
        self.transitions: list[Transition] = []
        self._rule_errors: list[str] = []
        self._timed_actions: list[_TimedAction] = []
        self._skills: ScriptedSkillers | None = None
        with ExitStack() as stack:
            self.assembly = assembly = stack.enter_context(Run(options))
            """The assembled run: its executive, blackboard, clock and main loop."""
            self._checks = AgentChecks([assembly], strict=strict)
            self._start_us = assembly.clock.now_us()
            stack.callback(start_recording(assembly, options).close)
            # before the recorder closes: the recording includes the finalization
            stack.callback(assembly.finalize)
            assembly.bus.subscribe(self._record_event, LogLine, RuleFired, *TRANSITION_TYPES)
            self._history = RunHistory(UNLIMITED, self._start_us)
            assembly.bus.subscribe(self._history.record_event, GoalTransition, PlanActionTransition)
            super().__init__(assembly.executive.env, assembly.board)
            stack.callback(self._close_interfaces)
            if scripted:
                self._skills = ScriptedSkillers(assembly)
                stack.callback(self._skills.close)
                assembly.loop.add(Hook.SKILL, self._skills.loop)
            assembly.loop.add(Hook.PRE_LOOP, self._call_timed_actions)
            watchdog = make_spin_watchdog(assembly)
            stack.callback(watchdog.stop)
            watchdog.start()
            with self._limit_real_time(), assembly.loop.busy_section():
                assembly.start()
            self._convert_mistakes(self._checks.check_loaded_files)
            self._stack = stack.pop_all()

    def __getattr__(self, name: str) -> Any:
        """Return a member of a plug-in, e.g. ``run.assert_properties`` of cxbridge-explore."""
        return find_member("run", self, name)

    def _record_event(self, event: Event) -> None:
        if isinstance(event, LogLine):
            if event.text.startswith(RULE_ERROR_CODE):
                cause = self.log[-1].text if self.log and self.log[-1].level is Level.ERROR else ""
                self._rule_errors.append(f"{cause} {event.text}".strip())
            self.log.append(event)
        elif isinstance(event, RuleFired):
            self.rules.append(event.rule)
        elif isinstance(event, TRANSITION_TYPES):
            self.transitions.append(event)

    def _convert_mistakes(self, check: Callable[[], None]) -> None:
        """Call a check of the agent, and convert its mistakes to an assertion error."""
        __tracebackhide__ = True
        try:
            check()
        except BrokenAgentError as error:
            raise AssertionError(
                f"{with_explanations(error, self.options)}; "
                "strict=False starts the agent without its broken parts"
            ) from None

    def close(self) -> None:
        """End the run and release its resources; further calls do nothing."""
        self._stack.close()

    @property
    def seconds(self) -> float:
        """The seconds since the start of the run, by its clock."""
        return (self.assembly.clock.now_us() - self._start_us) / MICROSECONDS

    def step(self, loops: int = 1) -> None:
        """Run cycles of the main loop."""
        check_number("loops", loops)
        end_count = self.assembly.loop.cycle_count + loops
        self._run_cycles(lambda: self.assembly.loop.cycle_count >= end_count)

    def advance(self, seconds: float) -> None:
        """Run cycles for a number of seconds of the run's clock."""
        check_number("seconds", seconds)
        end_s = self.seconds + seconds
        self._run_cycles(lambda: self.seconds >= end_s)

    def until(self, condition: Callable[[], object], timeout: float = 60.0) -> None:
        """Run until the condition is true after a cycle.

        :param timeout: the limit in seconds of the run's clock.
        :raises AssertionError: if the condition is still false at the limit.
        """
        if not self.wait_for(condition, timeout):
            raise AssertionError(self._add_goals(f"the condition was not met within {timeout:g} s"))

    def to_end(self, timeout: float = 600.0) -> None:
        """Run until the run is over, see `is_over`.

        An agent with only MAINTAIN goals, whose run has no end, runs for ``timeout``.

        :param timeout: the limit in seconds of the run's clock.
        :raises AssertionError: if the run is not over at the limit, or the agent quits before.
        """
        self.wait_for(lambda: self.is_over, timeout)
        executive = self.assembly.executive
        # a resting MAINTAIN goal never ends, so it is no failure of the run either
        if not self.is_over and not executive.maintaining_goals:
            raise AssertionError(self._add_goals(f"the run was not over within {timeout:g} s"))
        if executive.env.quit_requested and executive.goals.open_roots and not executive.maintaining_goals:
            raise AssertionError(self._add_goals("the agent quit before its root goals were over"))

    def wait_for(self, condition: Callable[[], object], timeout: float = 60.0) -> bool:
        """Run until the condition is true after a cycle, or the time limit is reached.

        :param timeout: the limit in seconds of the run's clock.
        :returns: whether the condition is true.
        """
        end_s = self.seconds + timeout
        is_met = False

        def is_done() -> bool:
            nonlocal is_met
            is_met = bool(condition())
            return is_met or self.seconds >= end_s

        self._run_cycles(is_done)
        return is_met

    @property
    def is_over(self) -> bool:
        """Whether a root goal has ended, no other is open, no skill runs and the agenda is empty.

        Resting MAINTAIN goals do not count as open. If the agent quits, the run is over once no skill runs.
        """
        return self.assembly.is_over and not (self._skills is not None and self._skills.running)

    def at(self, seconds: float, action: Callable[[], object]) -> None:
        """Call ``action`` before the rules in the first cycle that starts at this time or later.

        :param seconds: the time since the start of the run.
        """
        check_number("seconds", seconds)
        self._timed_actions.append(_TimedAction(self._start_us + round(seconds * MICROSECONDS), action))
        self._timed_actions.sort(key=lambda timed_action: timed_action.time_us)

    def _call_timed_actions(self) -> None:
        while self._timed_actions and self._timed_actions[0].time_us <= self.assembly.clock.now_us():
            self._timed_actions.pop(0).action()

    def _run_cycles(self, is_done: Callable[[], bool]) -> None:
        """Run cycles until ``is_done()`` is true after one, a rule has an error, or patience is exceeded."""
        loop, clock = self.assembly.loop, self.assembly.clock
        with self._limit_real_time() as expired:
            while not expired.is_set():
                start_us = clock.now_us()
                loop.run_once()
                clock.sleep_until(start_us + loop.period_us)
                # an error in a rule ends the test at once: later failures would only be its consequences
                if self._first_error or is_done():
                    break
        self._convert_mistakes(self._checks.check_new_files)
        if self._first_error:
            raise AssertionError(self._add_goals(f"an error in a rule: {self._first_error}"))

    @property
    def _first_error(self) -> str:
        """The first error of a rule; empty without one."""
        return next(iter((*self.assembly.executive.env.faults, *self._rule_errors)), "")

    @contextmanager
    def _limit_real_time(self) -> Iterator[threading.Event]:
        """Interrupt rules that fire forever.

        :raises AssertionError: on exit from the context, if :attr:`patience` is exceeded.
        """
        expired = threading.Event()

        def expire() -> None:
            expired.set()
            self.assembly.interrupt()

        timer = threading.Timer(self.patience, expire)
        timer.daemon = True
        timer.start()
        try:
            yield expired
        finally:
            timer.cancel()
        if expired.is_set():
            last_rules = self._describe_last_rules()
            raise AssertionError(
                self._add_goals(f"no end within {self.patience:g} s of real time; last rules: {last_rules}")
            )

    @property
    def skills(self) -> ScriptedSkillers:
        """The script of the skills.

        :raises AssertionError: if the run was not made with ``skiller="scripted"``.
        """
        if self._skills is None:
            raise AssertionError(f"skills are executed by '{self.options.skiller}' and cannot be scripted")
        return self._skills

    def unmet_skills(self) -> list[str]:
        """Return the complaints about entries of the script that no call used and that are not optional."""
        return [] if self._skills is None else self._skills.unmet()

    def goals(self, goal_class: str | None = None) -> list[GoalRecord]:
        """Return the goals of a class, or all goals, in the order of creation, including removed goals."""
        return [goal for goal in self._history.goals if goal_class is None or goal.goal_class == goal_class]

    def goal(self, name: str) -> GoalRecord:
        """Return the only goal with a name: an id, a class, or the start of an id.

        ``ID#2`` is the second goal with an id, ``CLASS#2`` the second goal of a class.

        :raises AssertionError: if no goal or several goals have the name.
        """
        goals = find_goals(self._history.goals, name)
        if len(goals) != 1:
            problem = (
                f"{len(goals)} goals have the name {name}, not one" if goals else f"there is no goal {name}"
            )
            raise AssertionError(self._add_goals(problem))
        return goals[0]

    def actions(self, name: str | None = None) -> list[PlanActionRecord]:
        """Return the plan-actions with a name, or all, in the order of creation, including removed actions.

        :raises AssertionError: if the domain has operators, but none with this name.
        """
        actions = [action for action in self._history.actions if name is None or action.name == name]
        operators = [str(row[0]) for row in self.assembly.executive.env.columns("domain-operator", "name")]
        if name and not actions and operators and name not in operators:
            raise AssertionError(f"there is no action '{name}'{bracketed_suggestion(name, operators)}")
        return actions

    def assert_outcomes(self, **outcomes: str) -> None:
        """Check the outcomes of all goals of the named classes; ``_`` in a class name also means ``-``.

        :raises AssertionError: if a class has no goal, or a goal has another outcome.
        """
        for name, outcome in outcomes.items():
            goals = self.goals(name) or self.goals(name.replace("_", "-"))
            wrong_goals = [
                f"{goal.id} is {goal.mode} {goal.outcome}" for goal in goals if goal.outcome != outcome
            ]
            if not goals or wrong_goals:
                problem = ", ".join(wrong_goals) or f"there is no goal of class {name}"
                raise AssertionError(self._add_goals(f"{name} should be {outcome}: {problem}"))

    def describe(self) -> list[str]:
        """Return the time, the goals, the last skills and rules, and the end of the log as lines of text."""
        lines = [f"after {self.seconds:.2f} s, {self.assembly.loop.cycle_count} loops", "goals:"]
        lines += [f"  {line}" for line in latest_lines(goal_tree(self._history.goals))]
        if self._skills is not None and self._skills.calls:
            lines.append("skills:")
            lines += [
                f"  {call.seconds:8.2f} s {call.name} "
                + " ".join(f"{key}={value!r}" for key, value in call.args.items())
                for call in self._skills.calls[-_MAX_LINES:]
            ]
        if self.rules:
            lines.append(f"last rules: {self._describe_last_rules()}")
        last_lines = [line for line in self.log if line.level is not Level.DEBUG][-_MAX_LINES:]
        if last_lines:
            lines.append("log:")
            lines += [
                f"  {(line.time_us - self._start_us) / MICROSECONDS:8.2f} s {line.level.value} "
                f"{line.component}: {line.text}"
                for line in last_lines
            ]
        return list(map(indent_lines, lines))

    def _describe_last_rules(self) -> str:
        """Return the last fired rules in order; several firings in a row become one entry with the count."""
        firing_counts = [(rule, len(list(firings))) for rule, firings in groupby(self.rules)]
        return ", ".join(rule if count == 1 else f"{rule} ({count} times)" for rule, count in firing_counts)

    def _add_goals(self, problem: str) -> str:
        """Return the text of an error with the time and the goals so far."""
        lines = [
            f"{problem} ({self.seconds:.2f} s into the run)",
            *latest_lines(goal_tree(self._history.goals)),
        ]
        return "\n".join(map(indent_lines, lines))

    def assert_golden(
        self,
        name: str | None = None,
        *,
        order: str = "partial",
        level: str = "transitions",
        time_tolerance: float | None = None,
    ) -> None:
        """Compare the run so far with a golden file, which ``pytest --update-golden`` writes.

        :param name: the name of the golden file; by default the name of the test.
        :param order: ``partial`` (the order of each goal's transitions) or ``total`` (the order of all).
        :param level: ``transitions`` or ``skills``.
        :param time_tolerance: the allowed difference between times in seconds; None: times are not compared.
        :raises AssertionError: if the runs differ, or there is no such file.
        :raises TraceError: if the order or level is unknown, or the file cannot be read or lacks times.
        """
        if self._golden is None:
            raise AssertionError("this run was not made by the fixture cx: it has no golden files")
        self._golden.compare_or_write(
            name,
            self.transitions,
            parse_choice(View, "level", level),
            parse_choice(Order, "order", order),
            tolerance_s=time_tolerance,
            start_us=self._start_us,
        )
