"""The servers of a run: plug-ins add them by options, for clients that watch the run while it lasts and after."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, ClassVar, Final

if TYPE_CHECKING:
    from cxbridge.run.assembly import Assembly
    from cxbridge.run.result import RunResult
    from cxbridge.run.team import Team

REST_S: Final = 0.02
"""Seconds between two calls of :meth:`RunServer.attend` while the main loop rests."""


class RunServer:
    """A server of a run. A subclass overrides what it needs."""

    stays: ClassVar[str] = ""
    """The server in words, if it goes on after the end of the run until the user ends it: ``the page``."""

    def serve(self, run: Assembly | Team) -> AbstractContextManager[object]:  # noqa: ARG002 - for subclasses
        """Return a context that serves a run: it is entered before the run starts."""
        return nullcontext()

    def attend(self) -> None:
        """Answer clients, in the thread of the main loop."""

    def finish(self, result: RunResult) -> None:
        """Note that the run has ended."""


def keep_serving(servers: Sequence[RunServer], is_over: Callable[[], bool], tick: Callable[[], None]) -> None:
    """Let servers answer their clients after the end of the run.

    :param is_over: whether the user has ended the servers.
    :param tick: called after each round of answers.
    """
    while not is_over():
        for server in servers:
            server.attend()
        tick()
        time.sleep(REST_S)
