"""Keeps chosen interfaces of two blackboards equal: each goes from the writer's board to the other one.

The gateway looks at both boards when something happened there, and every now and then, and makes the mirrors
be as they should (:meth:`Gateway.loop`). Listeners only take notes, so neither board waits for the other.
"""

from __future__ import annotations

import threading
import time
from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf
from typing import Final

from cxbridge.blackboard import BlackBoard, InterfaceInfo, Observer
from cxbridge.blackboard.gateway.mirror import MAX_PROXIES, Hooks, InterfaceMirror
from cxbridge.blackboard.patterns import Pattern
from cxbridge.closing import Closing
from cxbridge.errors import BlackBoardError, CxbridgeError
from cxbridge.events import EventBus, Logger

COMPONENT: Final = "Gateway"
"""Under which the gateway logs."""

SWEEP_S: Final = 0.25
"""Seconds between two looks at both boards when nothing came from them."""

RIVAL_S: Final = 1.0
"""Seconds that a writer must outlive one of the other side before it is mirrored there."""

_STOP_S: Final = 10.0

Key = tuple[str, str]
Survey = dict[Key, InterfaceInfo]


@dataclass(frozen=True, slots=True)
class MirrorInfo:
    """Describes an interface that is mirrored.

    :param uid: ``Type::id``.
    :param source: ``left`` or ``right``: the board that has the writer.
    :param writes: blocks that were carried to the other board.
    :param messages: messages that were carried to the writer.
    """

    uid: str
    source: str
    writes: int
    messages: int


class _BoardWatch(Observer):
    """Notifies the gateway that there is something to look at."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway

    def interface_created(self, interface_type: str, interface_id: str) -> None:  # noqa: ARG002 - an observer
        self._gateway.look_again()

    def interface_destroyed(self, interface_type: str, interface_id: str) -> None:  # noqa: ARG002
        self._gateway.look_again()


class Gateway(Closing):
    """Mirrors interfaces between two blackboards. A context manager; closes neither board.

    Either call :meth:`start`, which works in a thread, or :meth:`loop` again and again.

    :param left: a blackboard.
    :param right: another blackboard.
    :param patterns: what to mirror: ``Type::id`` with shell patterns, or a pattern for the type alone.
    :param bus: gets log lines.
    :param names: what to call the boards in log lines.
    :param sweep_s: seconds between two looks at both boards when nothing came from them.
    :param hide_past: show a Skiller as an idle one until it does something for a client of this gateway.
    :param on_end: called for each interface that is not mirrored any more, in the gateway's thread and before
        its readers notice: gets its ``Type::id``, and the reason for people.
    """

    def __init__(
        self,
        left: BlackBoard,
        right: BlackBoard,
        patterns: Iterable[str],
        *,
        bus: EventBus | None = None,
        names: tuple[str, str] = ("left", "right"),
        sweep_s: float = SWEEP_S,
        hide_past: bool = False,
        on_end: Callable[[str, str], None] = lambda _uid, _reason: None,
    ) -> None:
        self._hide_past: Final = hide_past
        self._on_end: Final = on_end
        self._boards: Final = (left, right)
        self._patterns: Final = tuple(Pattern.parse(text) for text in patterns)
        self._names: Final = names
        self._log: Final = None if bus is None else Logger(bus, COMPONENT)
        self._sweep_s = sweep_s
        self._mirrors: dict[Key, InterfaceMirror] = {}
        self._orphans: defaultdict[Key, deque[str]] = defaultdict(partial(deque, maxlen=MAX_PROXIES))
        self._rivals: dict[Key, float] = {}  # when there were writers on both sides, not ours
        self._warned: dict[object, str] = {}
        self._wake = threading.Event()
        self._dirty = threading.Event()
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None
        self._next_sweep_s = 0.0
        self._watch = _BoardWatch(self)
        for board in self._boards:
            board.on_connection(
                lambda _connected: self.look_again()
            )  # events during the loss are not repeated
            for pattern in self._patterns:
                board.register_observer(self._watch, pattern.type_glob, pattern.id_glob)

    # -- life

    def start(self) -> None:
        """Work in a thread until :meth:`close`."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="gateway", daemon=True)
            self._thread.start()

    def _run(self) -> None:
        while not self._stopping.is_set():
            self.loop()
            self._wake.wait(self._sweep_s)
            self._wake.clear()

    def close(self) -> None:
        """Carry over messages under way, close all instances on both boards. A second call does nothing."""
        if self._stopping.is_set():
            return
        self._stopping.set()
        self._wake.set()
        if self._thread is not None:
            self._thread.join(_STOP_S)
        for board in self._boards:
            board.unregister_observer(self._watch)
        if self._thread is None or not self._thread.is_alive():
            self._carry()
        for key, mirror in self._mirrors.items():
            mirror.close(f"the gateway to {'::'.join(key)} was closed")
        self._mirrors.clear()

    def look_again(self) -> None:
        """Look at both boards soon; for listeners, from any thread."""
        self._dirty.set()
        self._wake.set()

    # -- looking around

    def mirrors(self) -> Sequence[MirrorInfo]:
        """Return the present mirrors, in the order of their begin."""
        return [
            MirrorInfo(f"{kind}::{id_}", ("left", "right")[mirror.side], mirror.writes, mirror.sent)
            for (kind, id_), mirror in tuple(self._mirrors.items())
        ]

    @property
    def owes_release(self) -> bool:
        """Whether control may have to be given back as soon as a writer that is gone has returned."""
        return any(orphans and key not in self._mirrors for key, orphans in tuple(self._orphans.items()))

    # -- work

    def loop(self) -> None:
        """Carry over new data, and make or end mirrors; returns soon."""
        self._carry()
        now_s = time.monotonic()
        if self._dirty.is_set() or now_s >= self._next_sweep_s:
            self._dirty.clear()
            self._next_sweep_s = now_s + self._sweep_s
            self._reconcile()
            self._carry()

    def _carry(self) -> None:
        for mirror in self._mirrors.values():
            mirror.carry()

    def _reconcile(self) -> None:
        """End the mirrors that have lost a side, begin those that have become possible."""
        for key, mirror in list(self._mirrors.items()):
            if mirror.ended:  # first: a board that is away takes its time to say that it cannot be asked
                away = not self._boards[mirror.side].connected
                self._end(key, "the connection is lost" if away else mirror.ended)
        surveys = (self._survey(0), self._survey(1))
        for key, mirror in list(self._mirrors.items()):
            reason = mirror.ended or self._loss(key, mirror, surveys)
            if reason:
                self._end(key, reason)
                surveys = (self._survey(0), self._survey(1))
        for key in dict.fromkeys(key for survey in surveys for key in survey or ()):
            if key not in self._mirrors:
                self._try_to_mirror(key, surveys)

    def _end(self, key: Key, reason: str) -> None:
        """End a mirror."""
        uid = "::".join(key)
        mirror = self._mirrors.pop(key)
        self._on_end(uid, reason)
        mirror.close(f"{uid} of {self._names[mirror.side]} is lost: {reason}")
        self._info(f"{uid} is not mirrored any more: {reason}")

    def _survey(self, side: int) -> Survey | None:
        """Return the interfaces of a board that match; None when it cannot be asked."""
        found: Survey = {}
        if not self._boards[side].connected:  # asking would wait for it, and the other board with us
            self._warn_once(side, f"{self._names[side]} is away")
            return None
        try:
            for pattern in self._patterns:
                for info in self._boards[side].list(pattern.type_glob, pattern.id_glob):
                    found[info.type, info.id] = info
        except BlackBoardError as error:
            self._warn_once(side, f"{self._names[side]} cannot be asked: {error.message}")
            return None
        self._warned.pop(side, None)
        return found

    @staticmethod
    def _loss(key: Key, mirror: InterfaceMirror, surveys: tuple[Survey | None, Survey | None]) -> str:
        """Return why a mirror cannot continue; empty when it can."""
        for side, which in ((mirror.side, "its writer"), (1 - mirror.side, "the mirrored writer")):
            survey = surveys[side]
            if survey is None:
                return f"the blackboard of {which} does not answer"
            if key not in survey or not survey[key].has_writer:
                return f"{which} is gone"
        return ""

    def _try_to_mirror(self, key: Key, surveys: tuple[Survey | None, Survey | None]) -> None:
        infos = [None if survey is None else survey.get(key) for survey in surveys]
        writers = [side for side, info in enumerate(infos) if info is not None and info.has_writer]
        if None in surveys:
            return
        if not writers:
            self._rivals.pop(key, None)
            return
        if len(writers) > 1:
            self._rivals[key] = time.monotonic()
            self._warn_once(key, "there are writers on both sides, it is not mirrored")
            return
        if time.monotonic() - self._rivals.get(key, -inf) < RIVAL_S:
            # perhaps another gateway's, which stood in for the one that has gone and leaves in a moment:
            # to stand in for it would replace who comes next, and keep the two going forever
            return
        self._rivals.pop(key, None)
        side = writers[0]
        try:
            hooks = Hooks(self._wake.set, self.look_again, partial(self._warn_once, key))
            source, target = self._boards[side], self._boards[1 - side]
            self._mirrors[key] = InterfaceMirror(
                source, target, *key, side, hooks, self._orphans[key], hide_past=self._hide_past
            )
        except CxbridgeError as error:
            self._warn_once(key, f"cannot be mirrored: {error}")
            return
        self._warned.pop(key, None)
        self._info(f"{'::'.join(key)}: {self._names[side]} -> {self._names[1 - side]}")

    # -- for the log

    def _warn_once(self, about: object, text: str) -> None:
        """Warn of something, once as long as it lasts."""
        if self._warned.get(about) != text:
            self._warned[about] = text
            if self._log is not None:
                self._log.warn(f"{'::'.join(about)}: {text}" if isinstance(about, tuple) else text)

    def _info(self, text: str) -> None:
        if self._log is not None:
            self._log.info(text)
