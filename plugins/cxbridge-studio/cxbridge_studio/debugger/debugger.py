"""The debugger of rules: breakpoints, stepping, continuing. See docs/debugging.md.

CLIPS cannot suspend a right-hand side, the actions of a rule. While the rules are stopped between two
firings, the loop fires no rule. A stop within a right-hand side lasts as long as the call of
:meth:`Debugger.stop_at_line`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Final

from clips._clips import lib

from cxbridge.daemon.operations.operation import NotFoundError
from cxbridge.errors import ClipsError, ExecutiveError
from cxbridge.events import Event, SkillStatus
from cxbridge.executive.host.capi import CData, decode, make_callback
from cxbridge.executive.host.values import FALSE, value_text
from cxbridge.history.transitions import TRANSITION_TYPES, Transition
from cxbridge_studio.debugger.agenda import find_next_rule, read_activations
from cxbridge_studio.debugger.breakpoint_checker import BreakpointChecker
from cxbridge_studio.debugger.breakpoints import Breakpoint, Stop, describe_transition, parse_breakpoint

if TYPE_CHECKING:
    from cxbridge.executive.executive import Executive
    from cxbridge.executive.host.environment import ClipsEnvironment

STEP_UNITS: Final = ("rule", "loop", "transition")  # the units of steps

# The unit of a step to the next line of a right-hand side. The debug adapter alone offers this unit: it
# instruments rules with calls of `Debugger.stop_at_line`.
LINE_STEP: Final = "line"


def debugger_of(executive: Executive) -> Debugger:
    """Return the debugger of an executive, made on the first call."""
    with executive.env.lock:
        if executive.control is None:
            checker = BreakpointChecker(executive.env, executive.known_skills)
            executive.control = Debugger(executive.env, checker)
    assert isinstance(executive.control, Debugger), "no other module sets the control of an executive"
    return executive.control


class Debugger:
    """Stops and continues the executive's rules.

    Methods that change breakpoints, steps or stops wait for the environment's lock, so the changes of other
    threads take effect only between two firings or after a stop.

    :param env: the executive's environment.
    :param breakpoint_checker: detects unreachable breakpoints, by default those that name nothing in ``env``.
    """

    def __init__(self, env: ClipsEnvironment, breakpoint_checker: BreakpointChecker | None = None) -> None:
        self._env = env
        self.breakpoint_checker = breakpoint_checker or BreakpointChecker(env)
        self._log = env.bus.logger("Debugger")
        # The callback for each stop, in the thread of the rules, with the environment locked.
        self.on_stop: Callable[[Stop], None] | None = None
        # Returns an expression of a breakpoint with the values of the rule's variables in place of the
        # variables.
        self.expand: Callable[[str, Stop], str] = lambda text, _stop: text
        self.loop_count = 0  # the number of debugged loops
        self._breakpoints: dict[int, Breakpoint] = {}
        self._last_number = 0
        # By number of the breakpoint: all hits, and the hits with a true condition.
        self._hit_counts: Counter[int] = Counter()
        self._true_hit_counts: Counter[int] = Counter()
        self._stopped: Stop | None = None
        self._step_unit = ""  # the unit of the requested step; empty without a step
        self._is_stop_requested = False
        self._is_firing = False  # whether a transition comes from a rule
        self._is_in_loop = False
        self._is_interrupted = False  # whether a stop in a right-hand side ends the firing after that rule
        self._fired_count = 0  # the firings in this loop
        self._last_rule = ""
        self._fires_one_by_one = False  # whether each call of CLIPS fires one rule
        # The transitions of the last firing at which the rules stop, each with its breakpoint; None for a
        # step.
        self._transition_hits: list[tuple[Breakpoint | None, Transition]] = []
        self._last_statuses: dict[str, tuple[str, str]] = {}  # the skill string and status by Skiller
        # The activation of the last stop before a rule. It does not stop again.
        self._passed_activation = ""
        self._has_agent_halted = False  # whether a rule of the agent has called (halt) in this loop
        self._is_subscribed = False
        self._after_fire = make_callback("void(Environment *, Activation *, void *)", self._handle_firing)

    @property
    def breakpoints(self) -> tuple[Breakpoint, ...]:
        """The breakpoints in the order of their creation."""
        with self._env.lock:
            return tuple(self._breakpoints.values())

    def add(self, spec: str | Breakpoint, *, checked: bool = True) -> Breakpoint:
        """Add a breakpoint; return it with its number.

        :param checked: whether to refuse an unreachable breakpoint, see :meth:`BreakpointChecker.check`.
        :raises ExecutiveError: if the text is not a breakpoint, or the breakpoint is unreachable.
        """
        new_breakpoint = parse_breakpoint(spec) if isinstance(spec, str) else spec
        with self._env.lock:
            if checked:
                self.breakpoint_checker.check(new_breakpoint)
            self._last_number += 1
            new_breakpoint = replace(new_breakpoint, number=self._last_number)
            self._breakpoints[new_breakpoint.number] = new_breakpoint
            self._update_subscription()
        return new_breakpoint

    def remove(self, number: int) -> None:
        """Remove a breakpoint.

        :raises NotFoundError: if the breakpoint does not exist.
        """
        with self._env.lock:
            if number not in self._breakpoints:
                known_numbers = ", ".join(map(str, self._breakpoints)) or "none"
                raise NotFoundError(f"there is no breakpoint {number}; the breakpoints are: {known_numbers}")
            del self._breakpoints[number]
            self._update_subscription()

    def clear(self) -> None:
        """Remove all breakpoints."""
        with self._env.lock:
            self._breakpoints.clear()
            self._update_subscription()

    def count_hits(self, number: int) -> int:
        """Return how often the rules have reached a breakpoint."""
        return self._hit_counts[number]

    def move_to(self, executive: Executive) -> None:
        """Set the same breakpoints in the executive that follows the debugged executive after a reset.

        :raises ExecutiveError: if a breakpoint is unreachable there.
        """
        next_debugger = debugger_of(executive)
        for candidate in self.breakpoints:
            next_debugger.add(candidate)

    # -- state, and continuing

    @property
    def stopped(self) -> Stop | None:
        """The current stop; None while running."""
        return self._stopped

    @property
    def is_active(self) -> bool:
        """Whether the next loop needs the debugger."""
        return bool(
            self._breakpoints
            or self._step_unit
            or self._is_stop_requested
            or self._is_in_loop
            or self._stopped
        )

    @property
    def is_within_loop(self) -> bool:
        """Whether a loop has begun but not ended, or the rules are stopped before the next loop."""
        return self._is_in_loop or self._stopped is not None

    def stop(self) -> None:
        """Stop before the next firing."""
        with self._env.lock:
            self._is_stop_requested = self._stopped is None

    def go_on(self) -> None:
        """Continue to the next breakpoint; while running, cancel a requested stop and the present step."""
        with self._env.lock:
            self._is_stop_requested, self._stopped, self._step_unit = False, None, ""
            self._update_subscription()

    def step(self, unit: str = "rule") -> None:
        """Continue for one unit; running rules stop after the next unit.

        :param unit: one of :data:`STEP_UNITS`, or :data:`LINE_STEP`.
        :raises ExecutiveError: if the unit is unknown.
        """
        if unit not in (*STEP_UNITS, LINE_STEP):
            raise ExecutiveError(
                f"'{unit}' is not a unit of steps", hint=f"use one of: {', '.join(STEP_UNITS)}"
            )
        with self._env.lock:
            self.go_on()
            self._step_unit = unit
            self._update_subscription()

    def run(self) -> int:
        """Fire the rules of a loop, or its remaining rules, until a stop. :meth:`Executive.loop` calls this.

        :returns: the number of firings.
        """
        fired = 0
        while self._stopped is None:
            if not self._is_in_loop:
                self._begin_loop()
            fired_before = self._fired_count
            stop = self._fire_until_stop()
            fired += self._fired_count - fired_before
            self.breakpoint_checker.check_once(self._breakpoints.values())
            if stop is not None:
                self._enter_stop(stop)  # `on_stop` may continue the run before it returns
            if not self._is_in_loop:
                break
        return fired

    def _enter_stop(self, stop: Stop) -> None:
        """Enter the stopped state and notify the observer."""
        self._stopped, self._step_unit, self._is_stop_requested = stop, "", False
        self._log.info(f"Stopped {stop.reason}")
        if self.on_stop is not None:
            self.on_stop(stop)

    @property
    def watches_lines(self) -> bool:
        """Whether instrumented rules must call :meth:`stop_at_line` now."""
        return self._is_firing and (
            self._step_unit == LINE_STEP
            or any(candidate.kind == "line" for candidate in self._breakpoints.values())
        )

    def may_stop_at(self, rule: str, line: int) -> bool:
        """Return whether :meth:`stop_at_line` would evaluate a condition or stop."""
        return self._step_unit == LINE_STEP or any(
            candidate.matches_line(rule, line) for candidate in self._breakpoints.values()
        )

    def stop_at_line(self, rule: str, line: int) -> None:
        """Stop at a line of a right-hand side, if a breakpoint or a step requires that.

        Instrumented rules call this before an action if :attr:`watches_lines` and :meth:`may_stop_at` allow
        that.

        The stop ends when :attr:`on_stop` returns, because the right-hand side waits for that call.
        """
        self._last_rule = rule
        position_text = f"at line {line} of rule {rule}"
        stops = (
            self._count_hit(candidate, position_text, line=line)
            for candidate in self._breakpoints.values()
            if candidate.matches_line(rule, line)
        )
        stop = next(filter(None, stops), None)
        if stop is None and self._step_unit == LINE_STEP:
            stop = self._make_stop("step", position_text, line=line)
        if stop is None:
            return
        self._is_firing = False  # transitions that the user causes during the stop must not stop again
        try:
            self._enter_stop(stop)
        finally:
            self._stopped, self._is_firing = None, True
        # At the stop, the user may have set a breakpoint on another rule: end the firing after this rule, so
        # that the loop checks the breakpoints again.
        self._is_interrupted = True
        if not self._fires_one_by_one:
            self._env.api.set_hook("AfterRuleFires", self._after_fire)

    def _begin_loop(self) -> None:
        self._is_in_loop, self._has_agent_halted = True, False
        self._fired_count, self._last_rule, self._passed_activation = 0, "", ""
        self.loop_count += 1
        self._env.watcher.firings = 0

    def _fire_until_stop(self) -> Stop | None:
        """Fire rules until a stop or the end of the loop; return the stop, None without a stop."""
        env = self._env
        while not env.is_ended and not self._has_agent_halted and (rule := find_next_rule(env)):
            if self._is_stop_requested:
                return self._make_stop("asked", f"before rule {rule}, as asked")
            rule_breakpoints = [
                candidate for candidate in self._breakpoints.values() if candidate.is_rule_breakpoint
            ]
            if rule_breakpoints and (stop := self._stop_before(rule_breakpoints, rule)) is not None:
                return stop
            # Without breakpoints on rules, all rules fire at once, which is much faster.
            self._fires_one_by_one = bool(rule_breakpoints) or self._step_unit == "rule"
            fired = self._fire()
            if (stop := self._stop_after(rule_breakpoints, fired)) is not None:
                return stop
            if fired == 0 or not (self._fires_one_by_one or self._transition_hits or self._is_interrupted):
                break
        self._is_in_loop = False
        env.end_run()
        return self._make_stop("step", "at the end of the loop") if self._step_unit == "loop" else None

    def _fire(self) -> int:
        """Fire one rule, or all rules up to a stop at a transition or line; return the number of firings."""
        api = self._env.api
        self._transition_hits.clear()
        self._is_interrupted = False
        self._is_firing = True
        api.set_hook("AfterRuleFires", self._after_fire if self._fires_one_by_one else None)
        try:
            # With -1, CLIPS fires all activations.
            fired = self._env.fire(1 if self._fires_one_by_one else -1, self._fired_count)
        finally:
            self._is_firing = False
            api.set_hook("AfterRuleFires", None)
        self._fired_count += fired
        return fired

    def _stop_before(self, breakpoints: list[Breakpoint], next_rule: str) -> Stop | None:
        """Return the stop before the next rule; None without a stop.

        Each activation stops once, because it is still the first of the agenda after the stop.
        """
        for candidate in breakpoints:
            if candidate.kind == "before" and candidate.matches_rule(next_rule):
                _, rule, basis = next(read_activations(self._env))
                activation = f"{rule}: {basis}"
                is_new = activation != self._passed_activation
                if is_new and (stop := self._count_hit(candidate, f"before rule {rule}")):
                    self._passed_activation = activation
                    return stop
        return None

    def _stop_after(self, breakpoints: list[Breakpoint], fired: int) -> Stop | None:
        """Return the stop after the last firing; None without a stop.

        :param breakpoints: the breakpoints on rules.
        :param fired: the number of fired rules.
        """
        transition_stops = (
            self._make_stop("step", f"at {describe_transition(event)}", event=event)
            if hit_breakpoint is None
            else self._count_hit(hit_breakpoint, f"at {describe_transition(event)}", event)
            for hit_breakpoint, event in self._transition_hits
        )
        stop = next(filter(None, transition_stops), None)
        if stop is not None or not fired or not (self._fires_one_by_one or self._is_interrupted):
            return stop
        position_text = f"after rule {self._last_rule}"
        rule_stops = (
            self._count_hit(candidate, position_text)
            for candidate in breakpoints
            if candidate.kind == "after" and candidate.matches_rule(self._last_rule)
        )
        is_step = self._step_unit == "rule"
        return next(filter(None, rule_stops), self._make_stop("step", position_text) if is_step else None)

    def _count_hit(
        self, hit_breakpoint: Breakpoint, position_text: str, event: Transition | None = None, line: int = 0
    ) -> Stop | None:
        """Count a hit and return the stop.

        :returns: None if the condition or the hit count prevents the stop, or the breakpoint only logs.
        """
        kind = "transition" if event is not None else hit_breakpoint.kind
        self._hit_counts[hit_breakpoint.number] += 1
        stop = self._make_stop(kind, position_text, hit_breakpoint.number, event, line)
        if hit_breakpoint.condition:
            try:
                if self._env.eval(self.expand(hit_breakpoint.condition, stop)) == FALSE:
                    return None
            except ClipsError as error:  # the stop shows the user the mistake
                problem = f"(breakpoint {hit_breakpoint.number} has a condition that fails: {error.message})"
                stop = replace(stop, reason=f"{position_text} {problem}")
        self._true_hit_counts[hit_breakpoint.number] += 1
        if not hit_breakpoint.stops_at_hit(self._true_hit_counts[hit_breakpoint.number]):
            return None
        if hit_breakpoint.log_message:
            self._log.info(hit_breakpoint.format_log(partial(self._evaluate_to_text, stop=stop)))
            return None
        return stop

    def _evaluate_to_text(self, expression: str, stop: Stop) -> str:
        """Return the value of an expression as text, or its error."""
        try:
            value = self._env.eval(self.expand(expression, stop))
        except ClipsError as error:
            return f"{{{expression}: {error.message}}}"
        return value if isinstance(value, str) else value_text(value)

    def _make_stop(
        self, kind: str, reason: str, number: int = 0, event: Transition | None = None, line: int = 0
    ) -> Stop:
        return Stop(
            kind=kind,
            reason=reason,
            breakpoint=number,
            rule=self._last_rule,
            next_rule=find_next_rule(self._env),
            event=event,
            loop=self.loop_count,
            fired=self._fired_count,
            time_us=self._env.bus.clock.now_us(),
            line=line,
        )

    def _update_subscription(self) -> None:
        """Subscribe to transitions only while a breakpoint or step needs them."""
        is_needed = self._step_unit == "transition" or any(
            candidate.is_transition_breakpoint for candidate in self._breakpoints.values()
        )
        if is_needed and not self._is_subscribed:
            self._last_statuses.clear()
            self._env.bus.subscribe(self._handle_transition, *TRANSITION_TYPES)
        elif self._is_subscribed and not is_needed:
            self._env.bus.unsubscribe(self._handle_transition)
        self._is_subscribed = is_needed

    def _handle_transition(self, event: Event) -> None:
        """Record a transition at which the rules stop. Called within right-hand sides and between them."""
        if not isinstance(event, TRANSITION_TYPES) or event.env != self._env.name:
            return
        if isinstance(event, SkillStatus):
            # Each new fact of the Skiller causes an event, and the first event shows an earlier status.
            status = event.skill_string, event.status
            previous_status = self._last_statuses.get(event.skiller, status)
            self._last_statuses[event.skiller] = status
            if status == previous_status:
                return
        if not self._is_firing:
            return
        hits: list[Breakpoint | None] = [
            candidate for candidate in self._breakpoints.values() if candidate.matches_transition(event)
        ]
        # the step `transition` ends at a transition of a goal or a plan-action, not at a status of a Skiller
        if self._step_unit == "transition" and not isinstance(event, SkillStatus):
            hits.append(None)
        if hits and not self._transition_hits and not self._fires_one_by_one:
            self._env.api.set_hook("AfterRuleFires", self._after_fire)
        self._transition_hits += [(candidate, event) for candidate in hits]

    def _handle_firing(self, _env: CData, activation: CData, _context: CData) -> None:
        """Record the fired rule and its ``(halt)``, and end the firing if a stop is due. A hook of CLIPS."""
        self._last_rule = decode(lib.ActivationRuleName(activation))
        if self._env.api.is_halt_requested():
            self._has_agent_halted = True
        if (self._transition_hits or self._is_interrupted) and not self._fires_one_by_one:
            # Only after the check of is_halt_requested(), which cannot distinguish this halt from the
            # agent's.
            self._env.end_after_rule()
