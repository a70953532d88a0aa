"""Mirrors chosen interfaces from the writer's blackboard to another blackboard.

The gateway compares both boards after events and periodically, and adjusts its mirrors
(:meth:`Gateway.loop`). Listeners only set flags, so neither board waits for the other.
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
"""The gateway's log component."""

# events can be missed, for example while a connection is lost; four lists a second cost little
SWEEP_S: Final = 0.25
"""The period of comparing both boards without events, in seconds."""

RIVAL_S: Final = 1.0
"""Seconds that a writer must outlive a rival on the other board before it is mirrored."""

_STOP_S: Final = 10.0  # the thread may wait for a request to a lost board

Key = tuple[str, str]
Survey = dict[Key, InterfaceInfo]
"""The matching interfaces of a blackboard."""


@dataclass(frozen=True, slots=True)
class MirrorInfo:
    """Describes a mirrored interface.

    :param uid: ``Type::id``.
    :param source: ``left`` or ``right``, the writer's board.
    :param writes: the number of mirrored blocks.
    :param messages: the number of messages sent to the writer.
    """

    uid: str
    source: str
    writes: int
    messages: int


class Gateway(Observer, Closing):
    """Mirrors interfaces between two blackboards, which it leaves open. A context manager closes it.

    Call either :meth:`start`, which uses a thread, or :meth:`loop` periodically.

    :param left: a blackboard.
    :param right: another blackboard.
    :param patterns: the interfaces: ``Type::id`` with shell patterns, or a pattern for the type alone.
    :param bus: gets log lines.
    :param names: the boards' names in log lines.
    :param sweep_s: the period of comparing both boards without events, in seconds.
    :param hide_past: whether a Skiller appears idle until it works for a client of this gateway.
    :param on_end: called in the gateway's thread with ``Type::id`` and reason of an ending mirror, before its
        readers notice.
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
        self._rivals: dict[Key, float] = {}  # the time when both sides had foreign writers
        self._warned: dict[object, str] = {}  # the last warning about a side or an interface
        self._wake = threading.Event()  # the thread has work
        self._dirty = threading.Event()  # the boards may have changed
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None
        self._next_sweep_s = 0.0
        for board in self._boards:
            # events during a disconnection are not repeated
            board.on_connection(lambda _connected: self.request_sweep())
            for pattern in self._patterns:
                board.register_observer(self, pattern.type_glob, pattern.id_glob)

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
        """Deliver pending messages and close all instances on both boards. Further calls do nothing."""
        if self._stopping.is_set():
            return
        self._stopping.set()
        self._wake.set()
        if self._thread is not None:
            self._thread.join(_STOP_S)
        for board in self._boards:
            board.unregister_observer(self)
        if self._thread is None or not self._thread.is_alive():
            self._deliver_messages()
        for key, mirror in self._mirrors.items():
            mirror.close(f"the gateway to {'::'.join(key)} was closed")
        self._mirrors.clear()

    def existence_changed(self, interface_type: str, interface_id: str, *, created: bool) -> None:  # noqa: ARG002 - an observer's signature
        self.request_sweep()

    def request_sweep(self) -> None:
        """Request a comparison of both boards. Callable from any thread."""
        self._dirty.set()
        self._wake.set()

    def mirrors(self) -> Sequence[MirrorInfo]:
        """Return the present mirrors in order of their start."""
        return [
            MirrorInfo(f"{kind}::{id_}", ("left", "right")[mirror.side], mirror.writes, mirror.sent)
            for (kind, id_), mirror in tuple(self._mirrors.items())
        ]

    @property
    def owes_release(self) -> bool:
        """Whether a returning writer may have a closed instance of this gateway as its controller."""
        return any(orphans and key not in self._mirrors for key, orphans in tuple(self._orphans.items()))

    def loop(self) -> None:
        """Mirror new data, and start or end mirrors. Returns soon."""
        self._deliver_messages()
        now_s = time.monotonic()
        if self._dirty.is_set() or now_s >= self._next_sweep_s:
            self._dirty.clear()
            self._next_sweep_s = now_s + self._sweep_s
            self._reconcile()
            self._deliver_messages()

    def _deliver_messages(self) -> None:
        for mirror in self._mirrors.values():
            mirror.carry()

    def _reconcile(self) -> None:
        """End mirrors that lost a side, and start possible ones."""
        for key, mirror in list(self._mirrors.items()):
            if mirror.ended:  # before the surveys, which take long on a lost board
                connected = self._boards[mirror.side].connected
                self._end_mirror(key, mirror.ended if connected else "the connection is lost")
        surveys = (self._survey(0), self._survey(1))
        for key, mirror in list(self._mirrors.items()):
            reason = mirror.ended or self._reason_to_end(key, mirror, surveys)
            if reason:
                self._end_mirror(key, reason)
                surveys = (self._survey(0), self._survey(1))
        for key in dict.fromkeys(key for survey in surveys for key in survey or ()):
            if key not in self._mirrors:
                self._try_to_mirror(key, surveys)

    def _end_mirror(self, key: Key, reason: str) -> None:
        uid = "::".join(key)
        mirror = self._mirrors.pop(key)
        self._on_end(uid, reason)
        mirror.close(f"{uid} of {self._names[mirror.side]} is lost: {reason}")
        self._info(f"{uid} is not mirrored any more: {reason}")

    def _survey(self, side: int) -> Survey | None:
        """Return the matching interfaces of a board; None if it is unreachable."""
        survey: Survey = {}
        # a request would wait for the lost board, and block the other one
        if not self._boards[side].connected:
            self._warn_once(side, f"{self._names[side]} is away")
            return None
        try:
            for pattern in self._patterns:
                for info in self._boards[side].list(pattern.type_glob, pattern.id_glob):
                    survey[info.type, info.id] = info
        except BlackBoardError as error:
            self._warn_once(side, f"{self._names[side]} cannot be asked: {error.message}")
            return None
        self._warned.pop(side, None)
        return survey

    @staticmethod
    def _reason_to_end(
        key: Key, mirror: InterfaceMirror, surveys: tuple[Survey | None, Survey | None]
    ) -> str:
        """Return why a mirror must end; empty if it can continue."""
        for side, writer in ((mirror.side, "its writer"), (1 - mirror.side, "the mirrored writer")):
            survey = surveys[side]
            if survey is None:
                return f"the blackboard of {writer} does not answer"
            if key not in survey or not survey[key].has_writer:
                return f"{writer} is gone"
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
            # perhaps another gateway's writer, which replaced the lost one and will end soon: replacing it
            # would block the next writer and keep both gateways replacing each other forever
            return
        self._rivals.pop(key, None)
        side = writers[0]
        try:
            hooks = Hooks(self._wake.set, self.request_sweep, partial(self._warn_once, key))
            source, target = self._boards[side], self._boards[1 - side]
            self._mirrors[key] = InterfaceMirror(
                source, target, *key, side, hooks, self._orphans[key], hide_past=self._hide_past
            )
        except CxbridgeError as error:
            self._warn_once(key, f"cannot be mirrored: {error}")
            return
        self._warned.pop(key, None)
        self._info(f"{'::'.join(key)}: {self._names[side]} -> {self._names[1 - side]}")

    def _warn_once(self, subject: object, text: str) -> None:
        """Log a warning unless it is the last one about its subject.

        :param subject: a side, or the key of an interface.
        """
        if self._warned.get(subject) != text:
            self._warned[subject] = text
            if self._log is not None:
                self._log.warn(f"{'::'.join(subject)}: {text}" if isinstance(subject, tuple) else text)

    def _info(self, text: str) -> None:
        if self._log is not None:
            self._log.info(text)
