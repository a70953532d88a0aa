"""The common interface of a daemon and a single run for their web server."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Protocol

from cxbridge import __version__
from cxbridge.daemon.client import ask_why

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.clock import Clock
    from cxbridge.config import Configuration
    from cxbridge.events import EventBus
    from cxbridge.mainloop import MainLoop
    from cxbridge.space.tf.listener import TransformListener

_OWNER: Final = "TransformsRestApi"
_RULES: Final = 1
"""Rules that are listed of those that fired before each step of a goal."""


class HostedProcess(Protocol):
    """A daemon or a run."""

    @property
    def bus(self) -> EventBus:
        """What happens."""

    @property
    def config(self) -> Configuration:
        """The configuration."""

    @property
    def clock(self) -> Clock:
        """Its time."""

    @property
    def loop(self) -> MainLoop:
        """The main loop."""


class ProcessWebHost(ABC):
    """The common part of :class:`cxbridge_web.host.WebHost`.

    :param hosted: the source of the web server's data.
    """

    def __init__(self, hosted: HostedProcess) -> None:
        self._hosted: Final = hosted
        self._start_us: Final = hosted.clock.start_us
        self._transforms: TransformListener | None = None

    @property
    @abstractmethod
    def board(self) -> BlackBoard:
        """The blackboard."""

    @property
    def bus(self) -> EventBus:
        """What happens."""
        return self._hosted.bus

    @property
    def config(self) -> Configuration:
        """The configuration."""
        return self._hosted.config

    def frames(self) -> Mapping[str, str | None]:
        """Return the parent of each coordinate frame; listens to them from the first question on."""
        if self._transforms is None:
            from cxbridge.space.tf.listener import TransformListener  # noqa: PLC0415 - for those who ask

            self._transforms = TransformListener(self.board, owner=_OWNER)
        return self._transforms.buffer.frames

    def why(self, name: str, kind: str, timeout_s: float) -> dict[str, Any] | None:
        """Explain why a rule has not fired, or how a goal came about; not in the main loop's thread."""
        return ask_why(self.board, name, kind, _RULES, timeout_s)

    def _status(
        self,
        state: str,
        components: list[dict[str, Any]],
        *,
        now_us: int | None = None,
        endpoints: Sequence[str] = (),
        error: str = "",
    ) -> dict[str, Any]:
        """Return the fields of a status.

        :param now_us: None: the clock's time.
        """
        clock, loop = self._hosted.clock, self._hosted.loop
        return {
            "state": state,
            "version": __version__,
            "pid": os.getpid(),
            "started_us": self._start_us,
            "now_us": clock.now_us() if now_us is None else now_us,
            "clock": clock.name,
            "endpoints": list(endpoints),
            "error": error,
            "loop": {"count": loop.loops, "period_us": loop.period_us},
            "components": components,
        }
