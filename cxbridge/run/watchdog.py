"""Detection of a run or daemon in which nothing happens.

:class:`Watchdog` is a thread that detects a loop without end and describes its activity. :class:`Stalls`
reports such loops. :class:`StuckWatch` detects a run in which no event can follow;
:mod:`cxbridge.run.stuck` names the missing events.
"""

from __future__ import annotations

import sys
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Final, Protocol, Self

from msgspec import Struct

from cxbridge.executive.host.activity import MATCHING, executing, executing_functions

if TYPE_CHECKING:
    from cxbridge.events import Event, Logger
    from cxbridge.executive.executive import Executive
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.mainloop import MainLoop

LIMIT_S: Final = 5.0
"""The default limit of a loop in seconds. A longer loop is a stall."""

SPIN_S: Final = 1.5
"""The limit of a single right-hand side in seconds."""

HOPELESS_S: Final = 5.0
"""The limit of a right-hand side in tests, explorations and sweeps, which have no user to interrupt it."""

_TICK_S = 0.25  # seconds between looks at the loop
_AGAIN_S = 0.02
_PATIENCE_S = 0.1
_MOST_NAMES = 5  # rules in a report
_LOOKS = 20  # samples of the firing rule, taken in a row
_BETWEEN_LOOKS_S = 0.0005  # seconds between samples
_MOST_LOOKS = 12 * _LOOKS
_HALTED: Final = "[PRCCODE4]"
_TICK_RULES: Final = 2  # time-retract and blackboard-read fire in every tick
# The first check waits for this many loops without firings other than each tick's.
_QUIET_LOOPS: Final = 15

_PACKAGE = str(Path(__file__).resolve().parent.parent)


class Stall(Struct, frozen=True):
    """A loop that does not end.

    :param seconds: its duration so far, in real time.
    :param component: the active component; empty if unknown.
    :param what: the activity as text.
    :param in_rules: whether the time is spent in rules rather than in a function that they called.
    :param is_spin: whether a single right-hand side does not end.
    """

    seconds: float
    component: str
    what: str
    in_rules: bool
    is_spin: bool = False

    def __str__(self) -> str:
        return f"{self.what}, for {self.seconds:.0f} s now"


class WatchedAgent(Protocol):
    @property
    def name(self) -> str: ...

    @property
    def executive(self) -> Executive: ...

    @property
    def firings(self) -> int: ...

    @property
    def is_over(self) -> bool:
        """Whether the agent has finished."""

    @property
    def is_stuck(self) -> bool:
        """Whether no event can follow."""


class WatchedRun(Protocol):
    @property
    def loop(self) -> MainLoop: ...

    @property
    def agents(self) -> Sequence[WatchedAgent]: ...


running: Final[list[Watchdog]] = []
"""The running watchdogs. A thread does not survive a fork: a program that forks stops and restarts them."""


class Watchdog:
    """Watches a loop from another thread, between :meth:`start` and :meth:`stop`.

    :param loop: the loop in the thread that calls :meth:`start`.
    :param environments: returns the existing CLIPS environments.
    :param report: called in the watchdog's thread: with a stall at the limit and each time its duration has
        doubled, with None when the loop continues.
    :param limit_s: the limit of a loop in seconds.
    """

    # durations are counted in looks: after SIGSTOP or a laptop's sleep, elapsed time would look like a stall
    def __init__(
        self,
        loop: MainLoop,
        environments: Callable[[], Mapping[str, ClipsEnvironment]],
        report: Callable[[Stall | None], None],
        limit_s: float = LIMIT_S,
    ) -> None:
        self._loop, self._environments, self._report = loop, environments, report
        self._limit_s = limit_s
        self._wake = threading.Event()
        self._over = False
        self._wanted: int | None = None
        self._thread: threading.Thread | None = None
        self._watched = 0
        self._seen: deque[str] = deque(maxlen=_MOST_LOOKS)
        self._fired, self._still_s = 0, 0.0

    def start(self) -> None:
        """Watch the loop of the calling thread."""
        self._watched, self._over = threading.get_ident(), False
        self._wake.clear()
        running.append(self)
        self._thread = threading.Thread(target=self._run, name="watchdog", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop watching. Further calls do nothing."""
        thread, self._thread = self._thread, None
        if thread is not None:
            running.remove(self)
            self._over = True
            self._wake.set()
            thread.join()

    def interrupt(self) -> None:
        """Interrupt the rules of the current loop. Callable from any thread."""
        self._wanted = self._loop.turns
        self._wake.set()

    def _run(self) -> None:
        tick_s = min(_TICK_S, self._limit_s / 4) if self._limit_s else _TICK_S
        turn, took_s, reported_s = -1, 0.0, 0.0
        while not self._over:
            if self._wake.wait(tick_s):
                self._wake.clear()
                self._break_off()
                continue
            if self._loop.turns != turn or not self._loop.working:
                turn, took_s = self._loop.turns, 0.0
                self._seen.clear()
                self._still_s = 0.0
                if reported_s:
                    reported_s = 0.0
                    self._report(None)
                continue
            took_s += tick_s
            self._sample()
            limit_s = min(self._limit_s, SPIN_S) if self._is_spinning(tick_s) else self._limit_s
            if self._limit_s and took_s >= max(limit_s, 2 * reported_s):
                reported_s = took_s
                self._report(self._describe(took_s))

    def _break_off(self) -> None:
        """Interrupt the rules until the loop of the request has ended."""
        # the loop may have ended since the request: the next one must not be interrupted
        wanted, self._wanted = self._wanted, None
        pause_s = _PATIENCE_S
        while not self._over and self._loop.turns == wanted and self._loop.working:
            self._wake.wait(pause_s)
            if self._loop.turns == wanted:
                for env in tuple(self._environments().values()):
                    env.break_off()
            pause_s = _AGAIN_S

    def _sample(self) -> None:
        """Sample the active rules several times, with pauses in which the rules continue."""
        for env in tuple(self._environments().values()):
            for _ in range(_LOOKS):
                if rule := executing(env):
                    self._seen.append(rule)
                elif not env.is_firing:
                    break
                time.sleep(_BETWEEN_LOOKS_S)  # lets the thread of the rules run

    def _is_spinning(self, tick_s: float) -> bool:
        """Return whether the time is spent in a single right-hand side rather than in matching."""
        fired = sum(env.endless.fired for env in tuple(self._environments().values()))
        if fired != self._fired:
            self._fired, self._still_s = fired, 0.0
            return False
        self._still_s += tick_s
        return self._still_s >= min(self._limit_s, SPIN_S) and self._rules(_LOOKS)[:1] != [MATCHING]

    def _rules(self, looks: int = _MOST_LOOKS) -> list[str]:
        """Return the rules in the latest samples, most frequent first."""
        return [rule for rule, _ in Counter([*self._seen][-looks:]).most_common(_MOST_NAMES)]

    def _describe(self, took_s: float) -> Stall:
        frames = list(_frames(sys._current_frames().get(self._watched)))  # noqa: SLF001 - the only way to another thread's frames
        component = next(filter(None, map(_component, frames)), "")
        function = next(filter(None, map(_udf, frames)), "")
        firing = [env for env in tuple(self._environments().values()) if env.is_firing]
        in_rules, is_spin = bool(firing) and not function, not function and self._is_spinning(0.0)
        activity = self._activity(frames, function, firing)
        return Stall(took_s, component, activity, in_rules, is_spin)

    def _activity(self, frames: list[FrameType], function: str, firing: list[ClipsEnvironment]) -> str:
        rules = self._rules()
        if not firing:
            skill = next(filter(None, map(_skill, frames)), "")
            return f"skill {skill} does not end" if skill else f"a loop does not end, at {_place(frames)}"
        if function:
            by = f", which rule {rules[0]} has called" if rules and rules[0] != MATCHING else ""
            return f"function {function}{by}, does not end, at {_place(frames)}"
        if text := next(filter(None, (env.endless.text for env in firing)), ""):
            return text
        if rules == [MATCHING]:
            return "matching facts against the conditions of rules does not end"
        names = [rule for rule in rules if rule != MATCHING]
        if self._is_spinning(0.0):
            functions = [name for env in firing for name in executing_functions(env)]
            within = f", in function {', '.join(functions)}" if functions else ""
            return f"rule {self._rules(_LOOKS)[0]} does not end{within}"
        fired = sum(env.endless.fired for env in firing)
        return f"the rules of a loop do not end: {', '.join(names)}; {fired:,} have fired"


class Stalls:
    """Reports loops without end, and interrupts their rules on request. A context manager.

    :param environments: returns the CLIPS environments.
    :param advice: how a user can end the stall, for the log.
    :param limit_s: the limit of a loop in seconds.
    :param on_stall: called in the watchdog's thread after each report, with None when the loop continues.
    """

    def __init__(
        self,
        loop: MainLoop,
        environments: Callable[[], Mapping[str, ClipsEnvironment]],
        log: Logger,
        advice: str,
        *,
        limit_s: float = LIMIT_S,
        on_stall: Callable[[Stall | None], None],
    ) -> None:
        self._stall: Stall | None = None
        self._loop, self._turn = loop, -1
        self._log, self._advice, self._on_stall = log, advice, on_stall
        self.watchdog = Watchdog(loop, environments, self._report, limit_s)

    def __enter__(self) -> Self:
        self.watchdog.start()
        return self

    def __exit__(self, *_error: object) -> None:
        self.watchdog.stop()

    @property
    def text(self) -> str:
        """A description of the current stall; empty without one."""
        stall = self.now
        return "" if stall is None else str(stall)

    @property
    def now(self) -> Stall | None:
        """The current stall; None without one."""
        # the loop may have continued since the report
        return self._stall if self._loop.working and self._loop.turns == self._turn else None

    def interrupt(self) -> None:
        """Interrupt the rules of the current loop. Callable from any thread."""
        self._log.info("A client asks to interrupt")
        self.watchdog.interrupt()

    def _report(self, stall: Stall | None) -> None:
        self._stall, self._turn = stall, self._loop.turns
        if stall is not None:
            where = f"{stall.component}: " if stall.component else ""
            self._log.warn(f"{where}{stall}; {self._advice}")
        self._on_stall(stall)


class StuckWatch:
    """Checks periodically whether the agents of a run can still change anything.

    :param run: its agents may change.
    :param on: False with an interactive user, who may cause changes.
    """

    def __init__(self, run: WatchedRun, *, on: bool) -> None:
        self._run, self._is_on = run, on
        self._agents: Sequence[WatchedAgent] = run.agents
        self._fired = self._quiet = 0
        self._look_at = _QUIET_LOOPS

    def look(self) -> bool:
        """Return whether the run is stuck. To be called after each loop."""
        # a check takes milliseconds, so it waits for some quiet loops, and twice as long after each negative
        # result
        agents = self._run.agents
        if agents != self._agents:
            self._agents = agents
            self._quiet, self._look_at = 0, _QUIET_LOOPS
        fired = sum(agent.firings for agent in agents)
        before, self._fired = self._fired, fired
        if not self._is_on or fired - before > _TICK_RULES * len(agents):
            self._quiet, self._look_at = 0, _QUIET_LOOPS
            return False
        self._quiet += 1
        if self._quiet < self._look_at:
            return False
        self._look_at *= 2
        return all(agent.is_over or agent.is_stuck for agent in agents)


class RuleErrors:
    """Collects the names of rules with errors from CLIPS' log lines."""

    def __init__(self) -> None:
        self.rules: dict[str, None] = {}

    def __call__(self, event: Event) -> None:
        text = getattr(event, "text", "")
        if text.startswith(_HALTED) and "'" in text:
            self.rules[text.split("'")[1]] = None


def end_spins(run: WatchedRun) -> Watchdog:
    """Return a watchdog that ends right-hand sides without end, for runs without a user."""

    def environments() -> dict[str, ClipsEnvironment]:
        return {agent.name: agent.executive.env for agent in run.agents}

    def report(stall: Stall | None) -> None:
        if stall is not None and stall.is_spin and stall.seconds >= HOPELESS_S:
            for env in environments().values():
                if env.is_firing:
                    env.end_for_good(stall.what)

    return Watchdog(run.loop, environments, report)


def _frames(frame: FrameType | None) -> Iterator[FrameType]:
    """Yield the frames of a thread, innermost first."""
    while frame is not None:
        yield frame
        frame = frame.f_back


def _component(frame: FrameType) -> str:
    if frame.f_code.co_qualname == "ComponentManager.guarded.<locals>.run":
        return str(frame.f_locals["node"].name)
    return ""


def _skill(frame: FrameType) -> str:
    """Return the skill string if the frame is a Lua Skiller's step; else empty."""
    # the engine's budget counts Lua instructions, but none inside C functions such as string.find
    if frame.f_code.co_qualname == "Skiller.loop":
        return str(frame.f_locals["self"].skill_string)
    return ""


def _udf(frame: FrameType) -> str:
    """Return the CLIPS function if the frame is a call of ``UdfTable``; else empty."""
    if frame.f_code.co_qualname == "UdfTable._wrap.<locals>.call":
        return str(frame.f_locals["name"])
    return ""


def _place(frames: Iterable[FrameType]) -> str:
    """Return file and line of the innermost frame in this package."""
    for frame in frames:
        path = frame.f_code.co_filename
        if path.startswith(_PACKAGE):
            return f"{Path(path).relative_to(Path(_PACKAGE).parent)}:{frame.f_lineno}"
    return "an unknown place"
