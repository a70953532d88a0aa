"""Why nothing happens in a run or a daemon: a loop does not end, or nothing can happen any more.

:class:`Watchdog` is the thread that notices a loop which does not end, and finds out why; :class:`Stalls`
reports such a loop. :class:`StuckWatch` notices a run in which nothing can happen any more; the executive
names the events that the run waits for (:mod:`cxbridge.run.ending.stuck`).
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
from cxbridge.process import forking

if TYPE_CHECKING:
    from cxbridge.events import Event, Logger
    from cxbridge.executive.executive import Executive
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.mainloop import MainLoop

LIMIT_S: Final = 5.0
"""Seconds that a loop may take by default before it counts as a stall."""

SPIN_S: Final = 1.5
"""Seconds after which a right-hand side that does not end counts as a stall, if the limit is not less."""

HOPELESS_S: Final = 5.0
"""Seconds after which a right-hand side is ended in tests, explorations and sweeps, which no user watches."""

_TICK_S = 0.25
_AGAIN_S = 0.02
_PATIENCE_S = 0.1
_MOST_NAMES = 5
_LOOKS = 20
_BETWEEN_LOOKS_S = 0.0005
_MOST_LOOKS = 12 * _LOOKS
_HALTED: Final = "[PRCCODE4]"
_TICK_RULES: Final = 2
_QUIET_LOOPS: Final = 15
"""Loops without a rule but those of each tick, after which it is worth to look."""

_PACKAGE = str(Path(__file__).resolve().parent.parent)


class Stall(Struct, frozen=True):
    """A loop that does not come to its end.

    :param seconds: how long it has taken by now, in real time.
    :param component: which component is at work; empty: it is not known.
    :param what: the work of the loop, in words.
    :param in_rules: whether rules are at work, and nothing that they wait for.
    :param is_spin: whether it is one right-hand side that does not end.
    """

    seconds: float
    component: str
    what: str
    in_rules: bool
    is_spin: bool = False

    def __str__(self) -> str:
        """Return it for people."""
        return f"{self.what}, for {self.seconds:.0f} s now"


class WatchedAgent(Protocol):
    """An agent of a run."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def executive(self) -> Executive:
        """Its executive."""

    @property
    def firings(self) -> int:
        """How many rules have fired."""

    @property
    def is_over(self) -> bool:
        """Whether it has nothing left to do."""

    @property
    def is_stuck(self) -> bool:
        """Whether nothing can happen to it any more."""


class WatchedRun(Protocol):
    """A run of agents."""

    @property
    def loop(self) -> MainLoop:
        """Its main loop."""

    @property
    def agents(self) -> Sequence[WatchedAgent]:
        """Its agents."""


class Watchdog:
    """Watches a loop from another thread, from :meth:`start` to :meth:`stop`.

    It counts its own looks and not the time: a process that is stopped for a while (SIGSTOP, a laptop that
    sleeps) has not hung.

    :param loop: the loop, which runs in the thread that calls :meth:`start`.
    :param environments: returns the CLIPS environments there are.
    :param report: gets a stall when the limit has passed, and again each time the time has doubled; gets None
        when the loop continues. Called in the watchdog's thread.
    :param limit_s: seconds that a loop may take.
    """

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
        forking.threads.append(self)
        self._thread = threading.Thread(target=self._run, name="watchdog", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Watch no more; a second call does nothing."""
        thread, self._thread = self._thread, None
        if thread is not None:
            forking.threads.remove(self)
            self._over = True
            self._wake.set()
            thread.join()

    def interrupt(self) -> None:
        """End what rules do in this loop, unless it comes to its end at once. From any thread."""
        self._wanted = self._loop.turns
        self._wake.set()

    # -- in the thread

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
            self._look()
            limit_s = min(self._limit_s, SPIN_S) if self._is_spinning(tick_s) else self._limit_s
            if self._limit_s and took_s >= max(limit_s, 2 * reported_s):
                reported_s = took_s
                self._report(self._describe(took_s))

    def _break_off(self) -> None:
        """End what rules do, as long as the loop is the one that was meant."""
        wanted, self._wanted = self._wanted, None
        pause_s = _PATIENCE_S
        while not self._over and self._loop.turns == wanted and self._loop.working:
            self._wake.wait(pause_s)
            if self._loop.turns == wanted:
                for env in tuple(self._environments().values()):
                    env.break_off()
            pause_s = _AGAIN_S

    def _look(self) -> None:
        """Note what rules are at work: several looks, with time for the rules between them."""
        for env in tuple(self._environments().values()):
            for _ in range(_LOOKS):
                if rule := executing(env):
                    self._seen.append(rule)
                elif not env.is_firing:
                    break
                time.sleep(_BETWEEN_LOOKS_S)

    def _is_spinning(self, tick_s: float) -> bool:
        """Whether one right-hand side has been at work for long, and not the matching of facts."""
        fired = sum(env.endless.fired for env in tuple(self._environments().values()))
        if fired != self._fired:
            self._fired, self._still_s = fired, 0.0
            return False
        self._still_s += tick_s
        return self._still_s >= min(self._limit_s, SPIN_S) and self._rules(_LOOKS)[:1] != [MATCHING]

    def _rules(self, looks: int = _MOST_LOOKS) -> list[str]:
        """Return the rules that were at work in the last looks, the most frequent first."""
        return [rule for rule, _ in Counter([*self._seen][-looks:]).most_common(_MOST_NAMES)]

    def _describe(self, took_s: float) -> Stall:
        frames = list(_frames(sys._current_frames().get(self._watched)))  # noqa: SLF001 - how Python names it
        component = next(filter(None, map(_component, frames)), "")
        function = next(filter(None, map(_udf, frames)), "")
        firing = [env for env in tuple(self._environments().values()) if env.is_firing]
        in_rules, is_spin = bool(firing) and not function, not function and self._is_spinning(0.0)
        activity = self._what(frames, function, firing)
        return Stall(took_s, component, activity, in_rules, is_spin)

    def _what(self, frames: list[FrameType], function: str, firing: list[ClipsEnvironment]) -> str:
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
    """Reports a loop that does not come to its end, and ends what rules do in it. A context manager.

    :param environments: returns the CLIPS environments.
    :param advice: the action of a user that ends the stall, for the log.
    :param limit_s: seconds that a loop may take.
    :param on_stall: called after each report in the watchdog's thread, with None when the loop continues.
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
        """Why the loop does not come to its end; empty when it does."""
        stall = self.now
        return "" if stall is None else str(stall)

    @property
    def now(self) -> Stall | None:
        """The stall that was reported, while it lasts: the loop may have gone on in this moment."""
        return self._stall if self._loop.working and self._loop.turns == self._turn else None

    def interrupt(self) -> None:
        """End what rules do in this loop, unless it comes to its end at once; from any thread."""
        self._log.info("A client asks to interrupt")
        self.watchdog.interrupt()

    def _report(self, stall: Stall | None) -> None:
        self._stall, self._turn = stall, self._loop.turns
        if stall is not None:
            where = f"{stall.component}: " if stall.component else ""
            self._log.warn(f"{where}{stall}; {self._advice}")
        self._on_stall(stall)


class StuckWatch:
    """Looks from time to time whether the agents of a run can still do anything.

    :param run: its agents may come and go.
    :param on: whether to look at all: a user who looks on may interfere.
    """

    def __init__(self, run: WatchedRun, *, on: bool) -> None:
        self._run, self._is_on = run, on
        self._agents: Sequence[WatchedAgent] = run.agents
        self._fired = self._quiet = 0
        self._look_at = _QUIET_LOOPS

    def look(self) -> bool:
        """Return whether the run is stuck; to be called after each loop.

        To find out takes some milliseconds, so the watch tries when nothing has happened for some loops, and
        after twice as many again.
        """
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
    """Keeps in which rules there were errors, as CLIPS reports them; a sink of log lines."""

    def __init__(self) -> None:
        self.rules: dict[str, None] = {}

    def __call__(self, event: Event) -> None:
        """Take a log line."""
        text = getattr(event, "text", "")
        if text.startswith(_HALTED) and "'" in text:
            self.rules[text.split("'")[1]] = None


def end_spins(run: WatchedRun) -> Watchdog:
    """Return a watchdog for a run without a user: it ends a rule whose right-hand side does not end."""

    def environments() -> dict[str, ClipsEnvironment]:
        return {agent.name: agent.executive.env for agent in run.agents}

    def report(stall: Stall | None) -> None:
        if stall is not None and stall.is_spin and stall.seconds >= HOPELESS_S:
            for env in environments().values():
                if env.is_firing:
                    env.end_for_good(stall.what)

    return Watchdog(run.loop, environments, report)


def _frames(frame: FrameType | None) -> Iterator[FrameType]:
    """Yield the frames of a thread, the innermost first."""
    while frame is not None:
        yield frame
        frame = frame.f_back


def _component(frame: FrameType) -> str:
    """Return the name of the component whose step a frame is (``ComponentManager.guarded``)."""
    if frame.f_code.co_qualname == "ComponentManager.guarded.<locals>.run":
        return str(frame.f_locals["node"].name)
    return ""


def _skill(frame: FrameType) -> str:
    """Return the skill string of the Lua Skiller whose step a frame is."""
    # The budget of the engine counts instructions of Lua, none inside a function of C such as string.find.
    if frame.f_code.co_qualname == "Skiller.loop":
        return str(frame.f_locals["self"].skill_string)
    return ""


def _udf(frame: FrameType) -> str:
    """Return the function of CLIPS that a frame is (``UdfTable``)."""
    if frame.f_code.co_qualname == "UdfTable._wrap.<locals>.call":
        return str(frame.f_locals["name"])
    return ""


def _place(frames: Iterable[FrameType]) -> str:
    """Return where Python is: file and line, the innermost of ours."""
    for frame in frames:
        path = frame.f_code.co_filename
        if path.startswith(_PACKAGE):
            return f"{Path(path).relative_to(Path(_PACKAGE).parent)}:{frame.f_lineno}"
    return "an unknown place"
