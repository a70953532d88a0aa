"""A Skiller on another blackboard, mirrored to the local blackboard."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.errors import SkillerError
from cxbridge.events import EventBus
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge_fawkes.gateway import Gateway

MIRRORED_TYPES = ("SkillerInterface", "SkillerDebugInterface")
"""The types of the mirrored interfaces."""

# chosen freely
PATIENCE_S = 5.0
"""Seconds to wait for a Skiller at the start."""

# chosen freely
RELEASE_TIMEOUT_S = 2.0
"""Seconds for which `close` waits for the return of a lost Skiller, to release control of the Skiller."""

_POLL_S = 0.05  # seconds between two checks of the remote Skiller

OpenBlackBoard = Callable[[str], BlackBoard]


class RemoteSkiller:
    """Mirrors a Skiller's interfaces to the local blackboard, and messages to the Skiller.

    Uses a thread, because the remote blackboard may be slow or disconnected.

    :param board: the local blackboard.
    :param connect: opens the blackboard at the URL.
    :param patience_s: seconds to wait for the Skiller; 0 does not wait.
    :raises SkillerError: if no Skiller appears.
    :raises BlackBoardError: if the URL has no blackboard.
    """

    def __init__(
        self,
        url: str,
        board: BlackBoard,
        bus: EventBus,
        connect: OpenBlackBoard,
        *,
        patience_s: float = PATIENCE_S,
    ) -> None:
        self.url = url
        self._was_found = False
        self._loss_reason = ""
        self._remote = connect(url)
        self._gateway = Gateway(
            self._remote,
            board,
            MIRRORED_TYPES,
            bus=bus,
            names=(url, "here"),
            hide_past=True,
            on_end=self._record_end,
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
        while not self._has_skiller():
            if time.monotonic() >= end_s:
                raise SkillerError(
                    f"there is no Skiller at {self.url}",
                    hint="is a Skiller running there? see 'cxbridge bb list --connect URL'",
                )
            time.sleep(_POLL_S)
        self._was_found = True

    def _has_skiller(self) -> bool:
        return any(mirror.uid.startswith("SkillerInterface::") for mirror in self._gateway.mirrors())

    def _record_end(self, _uid: str, reason: str) -> None:
        """Record the end of a mirrored interface. Called in the gateway's thread."""
        if self._was_found and not self._loss_reason and not self._has_skiller():
            self._loss_reason = (
                f"the Skiller at {self.url} is gone, and with it the skills under way: {reason}"
            )

    @property
    def loss_reason(self) -> str:
        """Why the Skiller is lost; empty before its loss, and always if the start did not wait for it."""
        return self._loss_reason

    def close(self) -> None:
        """Deliver the pending messages and disconnect from both blackboards."""
        end_s = time.monotonic() + RELEASE_TIMEOUT_S
        # a Fawkes that reloads its Skiller keeps the old controller, so wait until the gateway can release
        # control
        while self._remote.connected and self._gateway.owes_release and time.monotonic() < end_s:
            time.sleep(_POLL_S)
        if not self._remote.connected:
            # else pending requests to the lost blackboard would run into their timeouts first
            self._remote.shutdown()
        self._gateway.close()
        self._remote.shutdown()


class RemoteSkillerComponent(RemoteSkiller, Component):
    """Mirrors the Skiller of the blackboard that the option ``skiller`` names.

    A run waits for the Skiller and ends without it. A daemon continues without it.

    :raises CxbridgeError: if the URL has no blackboard, or no Skiller appears in time.
    """

    description = "Mirrors the Skiller that executes skills"

    def __init__(self, context: Run) -> None:
        connect = partial(open_blackboard, registry=context.registry, clock=context.clock, bus=context.bus)
        patience_s = PATIENCE_S if context.waits_for_skiller else 0
        super().__init__(context.options.skiller, context.board, context.bus, connect, patience_s=patience_s)
