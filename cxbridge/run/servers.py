"""The servers of a run, for clients that watch the run; the options of plug-ins add them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Any, ClassVar, Final, TypeAlias

if TYPE_CHECKING:
    from cxbridge.run.result import RunResult


REST_S: Final = 0.02
"""Seconds between two calls of :meth:`RunServer.attend` while the main loop rests."""


class RunServer:
    """A server of a run. A subclass overrides the methods that it needs."""

    stays: ClassVar[str] = ""
    """The server in words, if it stays after the end of the run until the user ends it: ``the page``."""

    def serve(self, run: Any) -> AbstractContextManager[object]:  # noqa: ARG002 - for subclasses
        """Return a context that serves a run: it is entered before the run starts.

        :param run: an Run or a Team, which import the options that name the servers.
        """
        return nullcontext()

    def attend(self) -> None:
        """Answer clients, in the thread of the main loop."""

    def finish(self, result: RunResult) -> None:
        """Note that the run has ended."""


Stay: TypeAlias = "Callable[[RunResult, Sequence[RunServer]], Callable[[], bool]]"
"""Takes the result of a run whose servers stay; returns a test whether the user has ended the servers."""


def no_stay(_result: RunResult, _servers: Sequence[RunServer]) -> Callable[[], bool]:
    """End the servers with the run."""
    return lambda: True
