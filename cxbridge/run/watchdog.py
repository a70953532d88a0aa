"""Detection of a cycle of the main loop that does not end, because of a rule, a function or a skill.

:class:`Watchdog` measures each cycle in a separate thread, and describes a cycle that takes too long as a
:class:`Stall`. :class:`StallReporter` logs the stalls of a run or daemon, and interrupts their rules on
request.

The *right-hand side* of a rule is the part after ``=>``, the actions of the rule. The loop counts *turns*:
cycles, and other work that a watchdog limits, such as the start of a run.

:mod:`cxbridge.run.stuck` is about the opposite: a loop whose cycles change nothing.
"""

from __future__ import annotations

import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, Final, Self

from msgspec import Struct

from cxbridge.executive.host.activity import executing_rule_name
from cxbridge.executive.host.capi import MATCHING
from cxbridge.mainloop import MainLoop

if TYPE_CHECKING:
    from cxbridge.events import Logger
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.run.agent import Run
    from cxbridge.run.team import Team

    Environments = Callable[[], Mapping[str, ClipsEnvironment]]

STALL_S: Final = 5.0
"""The limit of a cycle in seconds. Longer than :data:`SPIN_S`, because many rules may fire in a cycle."""

# A right-hand side normally takes milliseconds: one that takes more than a second will hardly end.
SPIN_S: Final = 1.5
"""The limit of a single right-hand side in seconds."""

UNATTENDED_SPIN_S: Final = 5.0
"""The limit of a right-hand side in tests, explorations and sweeps, which have no user to interrupt the rule.

Longer than :data:`SPIN_S`: a right-hand side over that limit is only reported, here it ends the run.
"""

_TICK_S = 0.25  # seconds between two measurements of the loop
_FIRST_INTERRUPT_S = 0.1  # seconds in which an interrupted cycle may end by itself
_NEXT_INTERRUPT_S = 0.02  # short, because the next rule on the agenda may be endless, too
_MAX_SHOWN_RULES = 5  # in a description of a stall
_SAMPLE_COUNT = 20  # of the active rule, for the description of a stall
_SAMPLE_PAUSE_S = 0.0005  # seconds between two samples

_PACKAGE = Path(__file__).resolve().parent.parent


class Stall(Struct, frozen=True):
    """A cycle that does not end.

    :param seconds: the duration of the cycle so far, in real time.
    :param component: the active component of a daemon; empty if unknown.
    :param activity: the endless rule, function or skill, as text.
    :param is_in_rules: whether rules take the time, not a skill or a Python function that a rule has called.
    :param is_spin: whether a single right-hand side does not end.
    """

    seconds: float
    component: str
    activity: str
    is_in_rules: bool
    is_spin: bool = False

    def __str__(self) -> str:
        return f"{self.activity}, for {self.seconds:.0f} s now"


running_watchdogs: Final[list[Watchdog]] = []
"""The running watchdogs. A thread does not survive a fork: a program that forks stops and restarts them."""


class Watchdog:
    """Watches a loop from another thread, between :meth:`start` and :meth:`stop`.

    :param loop: the loop in the thread that calls :meth:`start`.
    :param environments: returns the existing CLIPS environments.
    :param report: called in the watchdog's thread: with a stall at the limit and each time its duration has
        doubled, with None when the loop continues.
    :param limit_s: the limit of a cycle in seconds.
    """

    def __init__(
        self,
        loop: MainLoop,
        environments: Environments,
        report: Callable[[Stall | None], None],
        limit_s: float = STALL_S,
    ) -> None:
        self._loop, self._environments, self._report = loop, environments, report
        self._limit_s = limit_s
        self._wake = threading.Event()
        self._is_stopped = False
        self._turn_to_interrupt: int | None = None
        self._thread: threading.Thread | None = None
        self._watched_thread = 0
        self._firing_count, self._same_rule_s = 0, 0.0

    def start(self) -> None:
        """Watch the loop of the calling thread."""
        self._watched_thread, self._is_stopped = threading.get_ident(), False
        self._wake.clear()
        running_watchdogs.append(self)
        self._thread = threading.Thread(target=self._run, name="watchdog", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop watching. Further calls do nothing."""
        thread, self._thread = self._thread, None
        if thread is not None:
            running_watchdogs.remove(self)
            self._is_stopped = True
            self._wake.set()
            thread.join()

    def interrupt(self) -> None:
        """Interrupt the rules of the current cycle. Callable from any thread."""
        self._turn_to_interrupt = self._loop.turn_count
        self._wake.set()

    def _list_environments(self) -> tuple[ClipsEnvironment, ...]:
        """Return the existing environments."""
        # a copy: rules in the watched thread may create and destroy environments
        return tuple(self._environments().values())

    def _run(self) -> None:
        """Measure the loop at each tick; the main function of the thread."""
        tick_s = min(_TICK_S, self._limit_s / 4)  # several measurements within a short limit
        turn, cycle_s, reported_s = -1, 0.0, 0.0
        while not self._is_stopped:
            if self._wake.wait(tick_s):
                self._wake.clear()
                self._interrupt_cycle()
                continue
            if self._loop.turn_count != turn or not self._loop.is_working:
                turn, cycle_s = self._loop.turn_count, 0.0
                self._same_rule_s = 0.0
                if reported_s:
                    reported_s = 0.0
                    self._report(None)
                continue
            # counted in ticks: after SIGSTOP or a laptop's sleep, elapsed time would look like a stall
            cycle_s += tick_s
            self._measure_right_hand_side(tick_s)
            # the shorter limit is not for matching: many facts may rightly take long to match
            is_spinning = self._has_long_firing and self._list_frequent_rules()[:1] != [MATCHING]
            limit_s = min(self._limit_s, SPIN_S) if is_spinning else self._limit_s
            # a report at the limit, then each time the duration has doubled
            if cycle_s >= max(limit_s, 2 * reported_s):
                reported_s = cycle_s
                self._report(self._make_stall(cycle_s))

    def _interrupt_cycle(self) -> None:
        """Interrupt the rules until the cycle of the request has ended."""
        # the cycle may have ended since the request, and the next cycle must not be interrupted
        turn, self._turn_to_interrupt = self._turn_to_interrupt, None
        pause_s = _FIRST_INTERRUPT_S
        while not self._is_stopped and self._loop.turn_count == turn and self._loop.is_working:
            self._wake.wait(pause_s)
            if self._loop.turn_count == turn:
                for env in self._list_environments():
                    env.abort_rule()
            pause_s = _NEXT_INTERRUPT_S

    def _list_frequent_rules(self) -> list[str]:
        """Sample the active rules while they continue; return the most frequent first.

        :data:`MATCHING` stands for all rules while facts are matched.
        """
        counts: Counter[str] = Counter()
        for env in self._list_environments():
            for _ in range(_SAMPLE_COUNT):
                if rule := executing_rule_name(env):
                    counts[rule] += 1
                elif not env.is_firing:  # no rule of this environment is active, and the others may have one
                    break
                time.sleep(_SAMPLE_PAUSE_S)  # releases the GIL, which the thread of the rules needs
        return [rule for rule, _ in counts.most_common(_MAX_SHOWN_RULES)]

    def _measure_right_hand_side(self, tick_s: float) -> None:
        """Add a tick to the duration of the current right-hand side, or restart it after a firing."""
        firing_count = sum(env.endless.firing_count for env in self._list_environments())
        self._same_rule_s = self._same_rule_s + tick_s if firing_count == self._firing_count else 0.0
        self._firing_count = firing_count

    @property
    def _has_long_firing(self) -> bool:
        """Whether a single right-hand side, or the matching, has lasted until the limit."""
        return self._same_rule_s >= min(self._limit_s, SPIN_S)

    def _make_stall(self, cycle_s: float) -> Stall:
        """Describe the current cycle by the call stack of the watched thread."""
        # the only way to another thread's frames
        frames = list(_walk_frames(sys._current_frames().get(self._watched_thread)))  # noqa: SLF001
        component = _read_local_value(
            frames, "ComponentManager.guarded.<locals>.run_step", lambda local_vars: local_vars["node"].name
        )
        function = _read_local_value(
            frames, "UdfTable._make_entry_point.<locals>.call", lambda local_vars: local_vars["name"]
        )
        rules = self._list_frequent_rules()
        # between two rules, an environment still counts as firing
        firing_envs = [env for env in self._list_environments() if env.is_firing] if rules else []
        is_in_rules = bool(firing_envs) and not function
        return Stall(
            cycle_s,
            component,
            self._describe_activity(frames, function, firing_envs, rules),
            is_in_rules=is_in_rules,
            is_spin=is_in_rules and self._has_long_firing and rules[0] != MATCHING,
        )

    def _describe_activity(
        self, frames: list[FrameType], function: str, firing_envs: list[ClipsEnvironment], rules: list[str]
    ) -> str:
        """Return the endless activity as text.

        :param function: the Python function that a rule has called; empty without one.
        :param firing_envs: the environments whose rules run.
        :param rules: the most frequent rules of these environments; empty without an environment.
        """
        if not firing_envs:
            # the Lua engine ends a skill with too many Lua instructions, but a single call of a C function
            # such as string.find may take any time
            skill = _read_local_value(
                frames, "Skiller.loop", lambda local_vars: local_vars["self"].skill_string
            )
            return (
                f"skill {skill} does not end"
                if skill
                else f"a loop does not end, at {_describe_innermost_location(frames)}"
            )
        if function:
            caller_text = f", which rule {rules[0]} has called" if rules[0] != MATCHING else ""
            return (
                f"function {function}{caller_text}, does not end, at {_describe_innermost_location(frames)}"
            )
        if ring_text := next(filter(None, (env.endless.ring_text for env in firing_envs)), ""):
            return ring_text
        if rules == [MATCHING]:
            return "matching facts against the conditions of rules does not end"
        if self._has_long_firing and rules[0] != MATCHING:
            return f"rule {rules[0]} does not end"
        names = ", ".join(rule for rule in rules if rule != MATCHING)
        firing_count = sum(env.endless.firing_count for env in firing_envs)
        return f"the rules of a loop do not end: {names}; {firing_count:,} have fired"


class StallReporter:
    """Logs endless cycles, and interrupts their rules on request. A context manager.

    :param environments: returns the CLIPS environments.
    :param advice: how a user can end the stall, for the log.
    :param on_stall: called in the watchdog's thread after each report, with None when the loop continues.
    """

    def __init__(
        self,
        loop: MainLoop,
        environments: Environments,
        log: Logger,
        advice: str,
        *,
        on_stall: Callable[[Stall | None], None],
    ) -> None:
        self._stall: Stall | None = None
        self._loop, self._turn = loop, -1
        self._log, self._advice, self._on_stall = log, advice, on_stall
        self.watchdog = Watchdog(loop, environments, self._report, STALL_S)

    def __enter__(self) -> Self:
        self.watchdog.start()
        return self

    def __exit__(self, *_error: object) -> None:
        self.watchdog.stop()

    @property
    def text(self) -> str:
        """A description of the current stall; empty without one."""
        return str(self.current or "")

    @property
    def current(self) -> Stall | None:
        """The current stall; None without one."""
        # the loop may have continued since the report
        return self._stall if self._loop.is_working and self._loop.turn_count == self._turn else None

    def interrupt(self) -> None:
        """Interrupt the rules of the current cycle. Callable from any thread."""
        self._log.info("A client asks to interrupt")
        self.watchdog.interrupt()

    def _report(self, stall: Stall | None) -> None:
        self._stall, self._turn = stall, self._loop.turn_count
        if stall is not None:
            component = f"{stall.component}: " if stall.component else ""
            self._log.warn(f"{component}{stall}; {self._advice}")
        self._on_stall(stall)


def environments_by_agent(run: Run | Team) -> dict[str, ClipsEnvironment]:
    """Return the CLIPS environments of a run by the names of their agents."""
    return {agent.name: agent.executive.env for agent in run.agents}


def make_spin_watchdog(run: Run | Team) -> Watchdog:
    """Return a watchdog that ends endless right-hand sides, for runs without a user."""

    def report(stall: Stall | None) -> None:
        if stall is not None and stall.is_spin and stall.seconds >= UNATTENDED_SPIN_S:
            for env in environments_by_agent(run).values():
                if env.is_firing:
                    env.end_faulty_run(stall.activity)

    return Watchdog(run.loop, lambda: environments_by_agent(run), report)


def _walk_frames(frame: FrameType | None) -> Iterator[FrameType]:
    """Yield a frame and its callers, innermost first."""
    while frame is not None:
        yield frame
        frame = frame.f_back


def _read_local_value(
    frames: Iterable[FrameType], function: str, read: Callable[[Mapping[str, Any]], object]
) -> str:
    """Return a value of the local variables of a function; empty if the function is not active.

    :param function: the function's qualified name.
    :param read: returns the value from the local variables.
    """
    calls = (frame for frame in frames if frame.f_code.co_qualname == function)
    return next((str(read(frame.f_locals)) for frame in calls), "")


def _describe_innermost_location(frames: Iterable[FrameType]) -> str:
    """Return file and line of the innermost frame in this package, as text; without one, say so."""
    for frame in frames:
        path = Path(frame.f_code.co_filename)
        if path.is_relative_to(_PACKAGE):
            return f"{path.relative_to(_PACKAGE.parent)}:{frame.f_lineno}"
    return "an unknown place"
