"""A daemon reports a loop that does not come to its end, and ends what rules do in it on request."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from cxbridge.daemon.board import INTERRUPT
from cxbridge.run.components.manager import ComponentStatus
from cxbridge.run.watchdog import Stall, Watchdog

if TYPE_CHECKING:
    from cxbridge.events import Logger
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.mainloop import MainLoop
    from cxbridge.process.systemd import Notifier


class DaemonStalls:
    """Describes a loop that does not come to its end.

    :param environments: returns the CLIPS environments there are.
    :param publish: publishes the report on the blackboard, from any thread.
    :param allowed: whether clients may interrupt.
    :param limit_s: seconds that a loop may take.
    """

    def __init__(
        self,
        loop: MainLoop,
        environments: Callable[[], Mapping[str, ClipsEnvironment]],
        log: Logger,
        notifier: Notifier,
        publish: Callable[[], None],
        *,
        allowed: bool,
        limit_s: float,
    ) -> None:
        self._stall: Stall | None = None
        self._loop, self._turn = loop, -1
        self._log, self._notifier, self._publish, self._allowed = log, notifier, publish, allowed
        self.watchdog = Watchdog(loop, environments, self._report, limit_s)

    @property
    def text(self) -> str:
        """Why the loop does not come to its end; empty when it does."""
        stall = self._now()
        return "" if stall is None else str(stall)

    def _now(self) -> Stall | None:
        """Return what was reported, while it is true: the loop may have gone on in this moment."""
        return self._stall if self._loop.working and self._loop.turns == self._turn else None

    def apply(self, components: Sequence[ComponentStatus]) -> list[ComponentStatus]:
        """Return how the components stand, with this as the reason of the one that it is about."""
        stall = self._now()
        if stall is None:
            return list(components)
        return [
            replace(status, reason=str(stall)) if status.name == stall.component else status
            for status in components
        ]

    def interrupt(self) -> None:
        """End what rules do in this loop, unless it comes to its end at once; from any thread."""
        self._log.info("A client asks to interrupt")
        self.watchdog.interrupt()

    def take_command(self, message: str) -> None:
        """Take a command that has come: a loop that is stuck cannot carry it out."""
        if not self._allowed or message == "ResumeMessage":
            return
        if message == INTERRUPT:
            self.interrupt()
        elif self._now() is not None:
            self.watchdog.interrupt()

    def _report(self, stall: Stall | None) -> None:
        """Report a loop that does not come to its end, or has come to it; in the watchdog's thread."""
        self._stall, self._turn = stall, self._loop.turns
        if stall is None:
            self._log.info("The loop goes on")
        else:
            where = f"{stall.component}: " if stall.component else ""
            self._log.warn(f"{where}{stall}; 'cxbridge daemon interrupt' ends what rules do")
            if self._loop.stopping:
                self.watchdog.interrupt()  # nobody else will
        self._notifier.status("goes on" if stall is None else str(stall))
        self._publish()
