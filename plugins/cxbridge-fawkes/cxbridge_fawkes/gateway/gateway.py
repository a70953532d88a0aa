"""The gateway, which mirrors interfaces from the blackboard of their writer to another blackboard.

A sweep compares the lists of both boards, ends mirrors that lost a side and starts possible mirrors. The
gateway sweeps after events and periodically (:meth:`Gateway.loop`). Listeners only queue data and set flags,
so that neither board waits for the other.
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
from cxbridge.blackboard.patterns import Pattern
from cxbridge.closing import Closing
from cxbridge.errors import BlackBoardError, CxbridgeError
from cxbridge.events import EventBus, Logger
from cxbridge_fawkes.gateway.mirror import MAX_PROXIES, InterfaceMirror

COMPONENT: Final = "Gateway"
"""The gateway's log component."""

# some events are not announced, e.g. a writer that opens an interface which readers already have open; four
# sweeps a second cost little
SWEEP_PERIOD_S: Final = 0.25
"""The seconds between sweeps without events."""

# four periods of sweeps: another gateway notices the end of the rival within one
RIVAL_PAUSE_S: Final = 1.0
"""The seconds between the end of a rival and the mirroring of the remaining writer.

A rival is a writer of the same interface on the other board.
"""

_STOP_TIMEOUT_S: Final = 10.0  # the thread may wait for a request to a lost board

InterfaceKey = tuple[str, str]
"""The type and the id of an interface."""
Listing = dict[InterfaceKey, InterfaceInfo]
"""The matching interfaces of a blackboard."""


@dataclass(frozen=True, slots=True)
class MirrorInfo:
    """A mirrored interface.

    :param uid: ``Type::id``.
    :param source: ``left`` or ``right``, the writer's board.
    """

    uid: str
    source: str


class Gateway(Observer, Closing):
    """Mirrors interfaces between two blackboards, which stay open. A context manager closes the gateway.

    Either :meth:`start` makes a thread, or the caller calls :meth:`loop` periodically.

    :param left: a blackboard.
    :param right: another blackboard.
    :param patterns: the interfaces: ``Type::id`` with shell patterns, or a pattern for the type alone.
    :param bus: gets log lines.
    :param names: the boards' names in log lines.
    :param sweep_period_s: the seconds between sweeps without events.
    :param hide_past: whether a Skiller appears idle until it works for a client of this gateway.
    :param on_end: called in the thread of :meth:`loop` with ``Type::id`` and the reason before a mirror ends,
        while its readers still have the last block of the writer. Not called by :meth:`close`.
    """

    def __init__(
        self,
        left: BlackBoard,
        right: BlackBoard,
        patterns: Iterable[str],
        *,
        bus: EventBus | None = None,
        names: tuple[str, str] = ("left", "right"),
        sweep_period_s: float = SWEEP_PERIOD_S,
        hide_past: bool = False,
        on_end: Callable[[str, str], None] = lambda _uid, _reason: None,
    ) -> None:
        self._hide_past: Final = hide_past
        self._on_end: Final = on_end
        self._boards: Final = (left, right)
        self._patterns: Final = tuple(Pattern.parse(text) for text in patterns)
        self._board_names: Final = names
        self._log: Final = Logger(bus or EventBus(left.clock), COMPONENT)
        self._sweep_period_s = sweep_period_s
        self._mirrors: dict[InterfaceKey, InterfaceMirror] = {}
        # the serials of closed proxies, see InterfaceMirror
        self._orphans: defaultdict[InterfaceKey, deque[str]] = defaultdict(partial(deque, maxlen=MAX_PROXIES))
        self._rival_times_s: dict[InterfaceKey, float] = {}  # the last time at which both boards had writers
        self._last_warnings: dict[object, str] = {}  # the last warning about a side or an interface
        self._has_work = threading.Event()
        self._sweep_requested = threading.Event()
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None
        self._next_sweep_s = 0.0
        for board in self._boards:
            # a board that is connected again does not report the events of the meantime
            board.add_connection_callback(lambda _connected: self.request_sweep())
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
            self._has_work.wait(self._sweep_period_s)
            self._has_work.clear()

    def close(self) -> None:
        """Deliver pending messages and close all instances of the gateway. Further calls have no effect."""
        if self._stopping.is_set():
            return
        self._stopping.set()
        self._has_work.set()
        if self._thread is not None:
            self._thread.join(_STOP_TIMEOUT_S)
        for board in self._boards:
            board.unregister_observer(self)
        # a thread that still waits for a board may be within a transfer itself
        if self._thread is None or not self._thread.is_alive():
            self._transfer()
        for key, mirror in self._mirrors.items():
            mirror.close(f"the gateway to {'::'.join(key)} was closed")
        self._mirrors.clear()

    def existence_changed(self, interface_type: str, interface_id: str, *, created: bool) -> None:  # noqa: ARG002 - an observer's signature
        self.request_sweep()

    def request_sweep(self) -> None:
        """Request a sweep. Callable from any thread."""
        self._sweep_requested.set()
        self._has_work.set()

    def mirrors(self) -> Sequence[MirrorInfo]:
        """Return the present mirrors in order of their start."""
        return [
            MirrorInfo("::".join(key), ("left", "right")[mirror.side])
            for key, mirror in tuple(self._mirrors.items())
        ]

    @property
    def owes_release(self) -> bool:
        """Whether a writer that returns may show a closed proxy of this gateway as its controller."""
        return any(orphans and key not in self._mirrors for key, orphans in tuple(self._orphans.items()))

    def loop(self) -> None:
        """Transfer queued data and messages, and sweep if a sweep is due."""
        self._transfer()
        now_s = time.monotonic()
        if self._sweep_requested.is_set() or now_s >= self._next_sweep_s:
            self._sweep_requested.clear()
            self._next_sweep_s = now_s + self._sweep_period_s
            self._sweep()
            self._transfer()

    def _transfer(self) -> None:
        for mirror in self._mirrors.values():
            mirror.transfer()

    def _sweep(self) -> None:
        """End mirrors that lost a side, and start possible mirrors."""
        for key, mirror in list(self._mirrors.items()):
            if mirror.end_reason:  # before the lists, which take long on a lost board
                connected = self._boards[mirror.side].connected
                self._end_mirror(key, mirror.end_reason if connected else "the connection is lost")
        listings = (self._list_interfaces(0), self._list_interfaces(1))
        for key, mirror in list(self._mirrors.items()):
            reason = mirror.end_reason or self._find_end_reason(key, mirror, listings)
            if reason:
                self._end_mirror(key, reason)
                # again, because the lists still have the writer of the mirror
                listings = (self._list_interfaces(0), self._list_interfaces(1))
        for key in dict.fromkeys(key for listing in listings for key in listing or ()):
            if key not in self._mirrors:
                self._try_to_mirror(key, listings)

    def _end_mirror(self, key: InterfaceKey, reason: str) -> None:
        uid = "::".join(key)
        mirror = self._mirrors.pop(key)
        self._on_end(uid, reason)
        mirror.close(f"{uid} of {self._board_names[mirror.side]} is lost: {reason}")
        self._log.info(f"{uid} is no longer mirrored: {reason}")

    def _list_interfaces(self, side: int) -> Listing | None:
        """Return the matching interfaces of a board; None if the board is unreachable.

        :param side: 0 for the left board, 1 for the right board.
        """
        listing: Listing = {}
        # a request to a lost board would wait for its return, and delay the mirrors
        if not self._boards[side].connected:
            self._warn_once(side, f"{self._board_names[side]} is not connected")
            return None
        try:
            for pattern in self._patterns:
                for info in self._boards[side].list(pattern.type_glob, pattern.id_glob):
                    listing[info.type, info.id] = info
        except BlackBoardError as error:
            self._warn_once(side, f"{self._board_names[side]} cannot list its interfaces: {error.message}")
            return None
        self._last_warnings.pop(side, None)
        return listing

    @staticmethod
    def _find_end_reason(
        key: InterfaceKey, mirror: InterfaceMirror, listings: tuple[Listing | None, Listing | None]
    ) -> str:
        """Return the reason why a mirror must end; empty if it can continue."""
        for side, writer in ((mirror.side, "its writer"), (1 - mirror.side, "the mirrored writer")):
            listing = listings[side]
            if listing is None:
                return f"the blackboard of {writer} does not reply"
            if key not in listing or not listing[key].has_writer:
                return f"{writer} is gone"
        return ""

    def _try_to_mirror(self, key: InterfaceKey, listings: tuple[Listing | None, Listing | None]) -> None:
        """Start the mirror of an interface, if exactly one board has a writer."""
        infos = [None if listing is None else listing.get(key) for listing in listings]
        writer_sides = [side for side, info in enumerate(infos) if info is not None and info.has_writer]
        if None in listings:
            return
        if not writer_sides:
            self._rival_times_s.pop(key, None)
            return
        if len(writer_sides) > 1:
            self._rival_times_s[key] = time.monotonic()
            self._warn_once(key, "not mirrored, because both blackboards have a writer")
            return
        if time.monotonic() - self._rival_times_s.get(key, -inf) < RIVAL_PAUSE_S:
            # the remaining writer may be another gateway's mirror of the lost writer, which will end soon: a
            # mirror of that mirror would become the next rival, and both gateways would replace each other
            # forever
            return
        self._rival_times_s.pop(key, None)
        side = writer_sides[0]
        try:
            self._mirrors[key] = InterfaceMirror(
                self._boards[side],
                self._boards[1 - side],
                *key,
                side,
                self._orphans[key],
                wake=self._has_work.set,
                request_sweep=self.request_sweep,
                warn=partial(self._warn_once, key),
                hide_past=self._hide_past,
            )
        except CxbridgeError as error:
            self._warn_once(key, f"cannot be mirrored: {error}")
            return
        self._last_warnings.pop(key, None)
        self._log.info(f"{'::'.join(key)}: {self._board_names[side]} -> {self._board_names[1 - side]}")

    def _warn_once(self, subject: object, text: str) -> None:
        """Log a warning unless it repeats the last warning about its subject.

        :param subject: a side, or the key of an interface.
        """
        if self._last_warnings.get(subject) != text:
            self._last_warnings[subject] = text
            self._log.warn(f"{'::'.join(subject)}: {text}" if isinstance(subject, tuple) else text)
