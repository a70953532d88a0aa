"""The debugger of rules: breakpoints, stepping, continuing. See docs/debugging.md.

CLIPS cannot suspend a right-hand side. Between rules, stopping means leaving the agenda alone. Within a
right-hand side, a stop lasts as long as the call of :meth:`Debugger.at_line`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from clips._clips import lib

from cxbridge.errors import ClipsError, ExecutiveError
from cxbridge.events import Event, SkillStatus
from cxbridge.executive.host.capi import CData, callback, decode
from cxbridge.executive.host.values import FALSE, show
from cxbridge.history.transitions import TRANSITION_TYPES, Transition
from cxbridge_studio.debugger.agenda import activations, next_rule
from cxbridge_studio.debugger.breakpoints import Breakpoint, Stop, describe, parse_breakpoint
from cxbridge_studio.debugger.names import AgentNames

if TYPE_CHECKING:
    from cxbridge.executive.executive import Executive
    from cxbridge.executive.host.environment import ClipsEnvironment

STEPS: Final = ("rule", "loop", "transition")  # units of stepping

# A further unit, the next line of a right-hand side: only rules with probes call `Debugger.at_line`.
LINE: Final = "line"


def debugger_of(executive: Executive) -> Debugger:
    """Return the debugger of an executive, made on the first call."""
    with executive.env.lock:
        if executive.control is None:
            names = AgentNames(
                executive.env, executive.known_skills, lambda file: file in executive.core_files
            )
            executive.control = Debugger(executive.env, names)
    control = executive.control
    if not isinstance(control, Debugger):
        raise ExecutiveError("the rules have another debugger")
    return control


class Debugger:
    """Stops and continues the executive's rules.

    Methods wait for the environment's lock, so other threads proceed only between rules.

    :param env: the executive's environment.
    :param names: the agent's known names, by default those in ``env``.
    """

    def __init__(self, env: ClipsEnvironment, names: AgentNames | None = None) -> None:
        self._env = env
        self.names = names or AgentNames(env)  # detects unreachable breakpoints
        self._log = env.bus.logger("Debugger")
        # Called at each stop in the thread of the rules, with the environment locked.
        self.on_stop: Callable[[Stop], None] | None = None
        # Substitutes the variables of a rule in conditions and texts of breakpoints.
        self.expand: Callable[[str, Stop], str] = lambda text, _stop: text
        self.loops = 0  # number of debugged loops
        self._breakpoints: dict[int, Breakpoint] = {}
        self._last_number = 0
        # By number of the breakpoint: all hits, and the hits with a true condition.
        self._hit_counts: Counter[int] = Counter()
        self._true_hit_counts: Counter[int] = Counter()
        self._stopped: Stop | None = None
        self._step = ""  # the unit of the requested step; empty without a step
        self._stop_requested = False
        self._firing = False  # whether CLIPS runs rules, so that transitions come from them
        self._in_loop = False
        self._interrupted = False  # whether a stop within the last right-hand side ended the firing
        self._fired_count = 0  # the firings in this loop
        self._last_rule = ""
        self._one_by_one = False  # whether the rules are fired one by one
        # The transitions of the last firing that stop; without a breakpoint for a step.
        self._hits: list[tuple[Breakpoint | None, Transition]] = []
        self._statuses: dict[str, tuple[str, str]] = {}  # skill string and status by Skiller
        self._passed_activation = ""  # the activation of the last stop before a rule: it does not stop again
        self._agent_halts = False  # whether a rule of the agent has called (halt) in this loop
        self._is_subscribed = False
        self._after_fire = callback("void(Environment *, Activation *, void *)", self._handle_firing)

    @property
    def breakpoints(self) -> tuple[Breakpoint, ...]:
        """The breakpoints in the order of their creation."""
        with self._env.lock:
            return tuple(self._breakpoints.values())

    def add(self, spec: str | Breakpoint, *, checked: bool = True) -> Breakpoint:
        """Add a breakpoint; return it with its number.

        :param checked: whether to refuse an unreachable breakpoint, see :meth:`AgentNames.check`.
        :raises ExecutiveError: if the text is not a breakpoint, or the breakpoint is unreachable.
        """
        item = parse_breakpoint(spec) if isinstance(spec, str) else spec
        with self._env.lock:
            if checked:
                self.names.check(item)
            self._last_number += 1
            item = replace(item, number=self._last_number)
            self._breakpoints[item.number] = item
            self._update_subscription()
        return item

    def remove(self, number: int) -> None:
        """Remove a breakpoint.

        :raises ExecutiveError: if the breakpoint does not exist.
        """
        with self._env.lock:
            if number not in self._breakpoints:
                known = ", ".join(map(str, self._breakpoints)) or "none"
                raise ExecutiveError(f"there is no breakpoint {number}", hint=f"there are: {known}")
            del self._breakpoints[number]
            self._update_subscription()

    def clear(self) -> None:
        with self._env.lock:
            self._breakpoints.clear()
            self._update_subscription()

    def counts(self, number: int) -> tuple[int, int]:
        """Return the number of hits of a breakpoint, and of hits with a true condition."""
        return self._hit_counts[number], self._true_hit_counts[number]

    def move_to(self, executive: Executive) -> None:
        """Set the same breakpoints in the executive that follows this one after a reset."""
        following = debugger_of(executive)
        for item in self.breakpoints:
            following.add(item)

    # -- state, and continuing

    @property
    def stopped(self) -> Stop | None:
        """The current stop; None while running."""
        return self._stopped

    @property
    def active(self) -> bool:
        """Whether the next loop needs the debugger."""
        return bool(self._breakpoints or self._step or self._stop_requested or self._in_loop or self._stopped)

    @property
    def within_loop(self) -> bool:
        """Whether a loop has begun but not ended, or the next one is blocked."""
        return self._in_loop or self._stopped is not None

    def stop(self) -> None:
        """Stop before the next firing."""
        with self._env.lock:
            self._stop_requested = self._stopped is None

    def go_on(self) -> None:
        """Continue to the next breakpoint. Does nothing while running."""
        with self._env.lock:
            self._stop_requested, self._stopped, self._step = False, None, ""
            self._update_subscription()

    def step(self, unit: str = "rule") -> None:
        """Continue for one ``rule``, ``loop`` or ``transition``. While running, stop after the next one.

        :raises ExecutiveError: if the unit is unknown.
        """
        if unit not in (*STEPS, LINE):
            raise ExecutiveError(f"cannot step a '{unit}'", hint=f"use one of: {', '.join(STEPS)}")
        with self._env.lock:
            self.go_on()
            self._step = unit
            self._update_subscription()

    def run(self) -> int:
        """Fire the rules of a loop, or its remaining rules, until a stop. Called by :meth:`Executive.loop`.

        :returns: the number of firings.
        """
        fired = 0
        while self._stopped is None:
            if not self._in_loop:
                self._begin_loop()
            fired_before = self._fired_count
            stop = self._fire_until_stop()
            fired += self._fired_count - fired_before
            self.names.check_once(self._breakpoints.values())
            if stop is not None:
                self._enter_stop(stop)  # `on_stop` may continue the run before it returns
            if not self._in_loop:
                break
        return fired

    def _enter_stop(self, stop: Stop) -> None:
        """Enter the stopped state and notify the observer."""
        self._stopped, self._step, self._stop_requested = stop, "", False
        self._log.info(f"Stopped {stop.reason}")
        if self.on_stop is not None:
            self.on_stop(stop)

    @property
    def watches_lines(self) -> bool:
        """Whether rules must call :meth:`at_line`."""
        return self._firing and (
            self._step == LINE or any(item.kind == "line" for item in self._breakpoints.values())
        )

    def may_stop_at(self, rule: str, line: int) -> bool:
        """Return whether :meth:`at_line` would evaluate a condition or stop."""
        return self._step == LINE or any(item.has_line(rule, line) for item in self._breakpoints.values())

    def at_line(self, rule: str, line: int) -> None:
        """Stop at a line of a right-hand side if necessary. Instrumented rules call this before each action.

        The stop ends when :attr:`on_stop` returns, because the right-hand side waits for that call.
        """
        if not self._firing:
            return
        self._last_rule = rule
        where = f"at line {line} of rule {rule}"
        stops = (
            self._count_hit(item, where, line=line)
            for item in self._breakpoints.values()
            if item.has_line(rule, line)
        )
        stop = next(filter(None, stops), None)
        if stop is None and self._step == LINE:
            stop = self._make_stop("step", where, line=line)
        if stop is None:
            return
        self._firing = False  # transitions caused by edits at the stop must not stop again
        try:
            self._enter_stop(stop)
        finally:
            self._stopped, self._firing = None, True
        # The next breakpoint may belong to another rule, so the agenda is checked again after this firing.
        self._interrupted = True
        if not self._one_by_one:
            self._env.api.set_hook("AfterRuleFires", self._after_fire)

    def _begin_loop(self) -> None:
        self._in_loop, self._agent_halts = True, False
        self._fired_count, self._last_rule, self._passed_activation = 0, "", ""
        self.loops += 1
        self._env.watcher.firings = 0

    def _fire_until_stop(self) -> Stop | None:
        """Fire rules until a stop or the end of the loop."""
        env = self._env
        while not env.is_ended and not self._agent_halts and (rule := next_rule(env)):
            if self._stop_requested:
                return self._make_stop("asked", f"before rule {rule}, as asked")
            of_rules = [item for item in self._breakpoints.values() if item.is_of_rules]
            if of_rules and (stop := self._stop_before(of_rules, rule)) is not None:
                return stop
            # Without breakpoints on rules, all rules fire at once, which is much faster.
            self._one_by_one = bool(of_rules) or self._step == "rule"
            fired = self._fire()
            if (stop := self._stop_after(of_rules, fired)) is not None:
                return stop
            if fired == 0 or not (self._one_by_one or self._hits or self._interrupted):
                break
        self._in_loop = False
        env.end_run()
        return self._make_stop("step", "at the end of the loop") if self._step == "loop" else None

    def _fire(self) -> int:
        """Fire one rule, or all rules up to a transition with a breakpoint; return the number of firings."""
        api = self._env.api
        self._hits.clear()
        self._interrupted = False
        self._firing = True
        api.set_hook("AfterRuleFires", self._after_fire if self._one_by_one else None)
        try:
            # -1 is CLIPS' number for all activations.
            fired = self._env.fire(1 if self._one_by_one else -1, self._fired_count)
        finally:
            self._firing = False
            api.set_hook("AfterRuleFires", None)
        self._fired_count += fired
        return fired

    def _stop_before(self, breakpoints: list[Breakpoint], next_rule: str) -> Stop | None:
        """Return the stop before the next rule, once per activation: it is still first after the stop."""
        for item in breakpoints:
            if item.kind == "before" and item.has_rule(next_rule):
                _, rule, basis = next(activations(self._env))
                activation = f"{rule}: {basis}"
                is_new = activation != self._passed_activation
                if is_new and (stop := self._count_hit(item, f"before rule {rule}")):
                    self._passed_activation = activation
                    return stop
        return None

    def _stop_after(self, breakpoints: list[Breakpoint], fired: int) -> Stop | None:
        """Return the stop after the last firing."""
        for item, event in self._hits:
            if item is None:
                return self._make_stop("step", f"at {describe(event)}", event=event)
            if (stop := self._count_hit(item, f"at {describe(event)}", event)) is not None:
                return stop
        if not fired or not (self._one_by_one or self._interrupted):
            return None
        where = f"after rule {self._last_rule}"
        for item in breakpoints:
            is_hit = item.kind == "after" and item.has_rule(self._last_rule)
            if is_hit and (stop := self._count_hit(item, where)) is not None:
                return stop
        return self._make_stop("step", where) if self._step == "rule" else None

    def _count_hit(
        self, item: Breakpoint, where: str, event: Transition | None = None, line: int = 0
    ) -> Stop | None:
        """Count a hit; return the stop, or None if condition or hit count prevent it."""
        kind = "transition" if event is not None else item.kind
        self._hit_counts[item.number] += 1
        stop = self._make_stop(kind, where, item.number, event, line)
        if item.condition:
            try:
                if self._env.eval(self.expand(item.condition, stop)) == FALSE:
                    return None
            except ClipsError as error:  # stops, so that the user sees the mistake
                problem = f"(breakpoint {item.number} has a condition that fails: {error.message})"
                stop = replace(stop, reason=f"{where} {problem}")
        self._true_hit_counts[item.number] += 1
        if not item.is_due(self._true_hit_counts[item.number]):
            return None
        if item.log:
            text = item.log_text(lambda expression: self._value_text(expression, stop))
            self._log.info(text)
            return None
        return stop

    def _value_text(self, expression: str, stop: Stop) -> str:
        """Return the value of an expression as text, or its error."""
        try:
            value = self._env.eval(self.expand(expression, stop))
        except ClipsError as error:
            return f"{{{expression}: {error.message}}}"
        return value if isinstance(value, str) else show(value)

    def _make_stop(
        self, kind: str, reason: str, number: int = 0, event: Transition | None = None, line: int = 0
    ) -> Stop:
        return Stop(
            kind=kind,
            reason=reason,
            breakpoint=number,
            rule=self._last_rule,
            next_rule=next_rule(self._env),
            event=event,
            loop=self.loops,
            fired=self._fired_count,
            time_us=self._env.bus.clock.now_us(),
            line=line,
        )

    def _update_subscription(self) -> None:
        """Subscribe to transitions only while a breakpoint or step needs them."""
        is_needed = self._step == "transition" or any(
            item.is_of_transitions for item in self._breakpoints.values()
        )
        if is_needed and not self._is_subscribed:
            self._statuses.clear()
            self._env.bus.subscribe(self._handle_transition, *TRANSITION_TYPES)
        elif self._is_subscribed and not is_needed:
            self._env.bus.unsubscribe(self._handle_transition)
        self._is_subscribed = is_needed

    def _handle_transition(self, event: Event) -> None:
        """Handle a transition, within a right-hand side."""
        if not isinstance(event, TRANSITION_TYPES) or event.env != self._env.name:
            return
        if isinstance(event, SkillStatus):
            # Each fact of the Skiller causes an event, and the first event only shows the present status.
            status = event.skill_string, event.status
            previous_status = self._statuses.get(event.skiller, status)
            self._statuses[event.skiller] = status
            if status == previous_status:
                return
        if not self._firing:
            return
        hits: list[Breakpoint | None] = [
            item for item in self._breakpoints.values() if item.has_transition(event)
        ]
        if self._step == "transition" and not isinstance(event, SkillStatus):
            hits.append(None)
        if hits and not self._hits and not self._one_by_one:
            self._env.api.set_hook("AfterRuleFires", self._after_fire)
        self._hits += [(item, event) for item in hits]

    def _handle_firing(self, _env: CData, activation: CData, _context: CData) -> None:
        """Record the fired rule and its ``(halt)``; end the run if a stop is pending."""
        self._last_rule = decode(lib.ActivationRuleName(activation))
        if self._env.api.is_halt_requested():
            self._agent_halts = True
        if (self._hits or self._interrupted) and not self._one_by_one:
            # After the check of is_halt_requested(), which cannot tell this halt from the agent's.
            self._env.hold()
