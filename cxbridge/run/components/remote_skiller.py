"""A Skiller on another blackboard, as if it were on ours."""

from __future__ import annotations

import time
from collections.abc import Callable

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.errors import SkillerError
from cxbridge.events import EventBus
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component

PATTERNS = ("SkillerInterface", "SkillerDebugInterface")
"""The interfaces that are mirrored."""

PATIENCE_S = 5.0
"""Seconds that the Skiller has to appear."""

RELEASE_S = 2.0
"""Seconds that a Skiller which is gone has to return, when a client had control of it."""

_POLL_S = 0.05

Opener = Callable[[str], BlackBoard]
"""Opens the blackboard at a URL."""


class RemoteSkiller:
    """Mirrors a Skiller's interfaces to our blackboard, and messages to the Skiller.

    Works in another thread: the other blackboard may be slow to answer, or away for a while.

    :param url: the blackboard with the Skiller.
    :param board: ours.
    :param open_blackboard: opens the blackboard at a URL.
    :param patience_s: how long to wait for the Skiller; 0: not at all, it may come later.
    :raises SkillerError: when there is no Skiller.
    :raises BlackBoardError: when the URL has no blackboard.
    """

    def __init__(
        self,
        url: str,
        board: BlackBoard,
        bus: EventBus,
        open_blackboard: Opener,
        *,
        patience_s: float = PATIENCE_S,
    ) -> None:
        from cxbridge.blackboard.gateway import Gateway  # noqa: PLC0415 - start-up time is a feature

        self.url = url
        self._met = False
        self._loss = ""
        self._remote = open_blackboard(url)
        names = (url, "here")
        self._gateway = Gateway(
            self._remote, board, PATTERNS, bus=bus, names=names, hide_past=True, on_end=self._note_end
        )
        self._gateway.start()
        if patience_s:
            try:
                self._await_skiller(patience_s)
            except SkillerError:
                self.close()
                raise

    def _await_skiller(self, patience_s: float) -> None:
        end_s = time.monotonic() + patience_s
        while True:
            if self._is_there():
                self._met = True
                return
            if time.monotonic() >= end_s:
                raise SkillerError(
                    f"there is no Skiller at {self.url}",
                    hint="is its skiller running there? see 'cxbridge bb list --connect URL'",
                )
            time.sleep(_POLL_S)

    def _is_there(self) -> bool:
        return any(mirror.uid.startswith("SkillerInterface::") for mirror in self._gateway.mirrors())

    def _note_end(self, _uid: str, reason: str) -> None:
        """Note, in the gateway's thread, that an interface is not mirrored any more."""
        if self._met and not self._loss and not self._is_there():
            self._loss = f"the Skiller at {self.url} is gone, and with it the skills under way: {reason}"

    @property
    def loss(self) -> str:
        """Why a run cannot continue: the Skiller is gone, or was gone; else empty."""
        return self._loss

    def close(self) -> None:
        """Carry over the messages that are under way, and leave both blackboards.

        A Fawkes that loads its Skiller again keeps its controller. So this waits a moment for the Skiller, to
        give control back.
        """
        end_s = time.monotonic() + RELEASE_S
        while self._remote.connected and self._gateway.owes_release and time.monotonic() < end_s:
            time.sleep(_POLL_S)
        if not self._remote.connected:
            self._remote.shutdown()  # else who is asking there waits for an answer first
        self._gateway.close()
        self._remote.shutdown()


class RemoteSkillers(Component):
    """Mirrors the Skiller of the blackboard at a URL.

    A run waits for the Skiller, and ends when it is gone; a daemon does without it until it comes.

    :raises CxbridgeError: when the URL has no blackboard, or the blackboard has no Skiller in time.
    """

    description = "Executes skills, or mirrors the Skiller that does"

    def __init__(self, context: Run) -> None:
        def open_there(url: str) -> BlackBoard:
            return open_blackboard(url, context.registry, context.clock, context.bus)

        self._remote = RemoteSkiller(
            context.options.skiller,
            context.board,
            context.bus,
            open_there,
            patience_s=PATIENCE_S if context.waits_for_skiller else 0,
        )

    @property
    def loss(self) -> str:
        """Why the run cannot continue."""
        return self._remote.loss

    def close(self) -> None:
        """Leave both blackboards."""
        self._remote.close()
