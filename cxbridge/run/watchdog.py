"""A thread that notices when a loop does not come to its end, and finds out why."""

from __future__ import annotations

import sys
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Final

from msgspec import Struct

from cxbridge.executive.host.activity import MATCHING, executing

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.mainloop import MainLoop

LIMIT_S: Final = 5.0
"""Seconds that a loop may take by default before it counts as a stall."""

_TICK_S = 0.25
_AGAIN_S = 0.02
_PATIENCE_S = 0.1
_MOST_NAMES = 5
_LOOKS = 20
_BETWEEN_LOOKS_S = 0.0005
_MOST_LOOKS = 12 * _LOOKS
_PACKAGE = str(Path(__file__).resolve().parent.parent)


class Stall(Struct, frozen=True):
    """A loop that does not come to its end.

    :param seconds: how long it has taken by now, in real time.
    :param component: which component is at work; empty: it is not known.
    :param what: what it does, for people.
    :param in_rules: whether rules are at work, and nothing that they wait for.
    """

    seconds: float
    component: str
    what: str
    in_rules: bool

    def __str__(self) -> str:
        """Return it for people."""
        return f"{self.what}, for {self.seconds:.0f} s now"


class Watchdog:
    """Watches a loop from a thread of its own, from :meth:`start` to :meth:`stop`.

    It counts its own looks and not the time: a process that is stopped for a while (SIGSTOP, a laptop that
    sleeps) has not hung.

    :param loop: the loop, which runs in the thread that calls :meth:`start`.
    :param environments: returns the CLIPS environments there are.
    :param report: gets a stall when the limit has passed, and again each time the time has doubled; gets None
        when the loop goes on. Called in the watchdog's thread.
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

    def start(self) -> None:
        """Watch the loop of the calling thread."""
        self._watched = threading.get_ident()
        self._thread = threading.Thread(target=self._run, name="watchdog", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Watch no more; a second call does nothing."""
        thread, self._thread = self._thread, None
        if thread is not None:
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
                if reported_s:
                    reported_s = 0.0
                    self._report(None)
                continue
            took_s += tick_s
            self._look()
            if self._limit_s and took_s >= max(self._limit_s, 2 * reported_s):
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

    def _describe(self, took_s: float) -> Stall:
        frames = list(_frames(sys._current_frames().get(self._watched)))  # noqa: SLF001 - how Python names it
        component = next(filter(None, map(_component, frames)), "")
        function = next(filter(None, map(_udf, frames)), "")
        firing = any(env.is_firing for env in tuple(self._environments().values()))
        return Stall(took_s, component, self._what(frames, function, firing=firing), firing and not function)

    def _what(self, frames: list[FrameType], function: str, *, firing: bool) -> str:
        rules = [rule for rule, _ in Counter(self._seen).most_common(_MOST_NAMES)]
        if not firing:
            skill = next(filter(None, map(_skill, frames)), "")
            return f"skill {skill} does not end" if skill else f"a loop does not end, at {_place(frames)}"
        if function:
            by = f", which rule {rules[0]} has called" if rules and rules[0] != MATCHING else ""
            return f"function {function}{by}, does not end, at {_place(frames)}"
        if rules == [MATCHING]:
            return "matching facts against the conditions of rules does not end"
        names = [rule for rule in rules if rule != MATCHING]
        if len(names) == 1:
            return f"rule {names[0]} does not end"
        return f"rules fire without an end: {', '.join(names)}" if names else "the rules do not end"


def _frames(frame: FrameType | None) -> Iterator[FrameType]:
    """Yield the frames of a thread, the innermost first."""
    while frame is not None:
        yield frame
        frame = frame.f_back


def _component(frame: FrameType) -> str:
    """Return the name of the component whose step a frame is (``LifecycleManager.guarded``)."""
    if frame.f_code.co_qualname == "LifecycleManager.guarded.<locals>.run":
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
