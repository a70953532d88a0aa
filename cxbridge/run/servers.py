"""Servers of a run for clients that watch it. Option groups of plug-ins add servers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Any, ClassVar, Final, TypeAlias

if TYPE_CHECKING:
    from cxbridge.run.result import RunResult


ATTEND_PAUSE_S: Final = 0.02
"""Seconds between two calls of :meth:`RunServer.attend` while the main loop is paused."""


class RunServer:
    """A server of a run. Subclasses override the methods they need."""

    stays: ClassVar[str] = ""
    """The name of a server that stays after the end of the run until the user ends it, e.g. ``the page``."""

    def serve(self, run: Any) -> AbstractContextManager[object]:  # noqa: ARG002 - for subclasses
        """Return a context manager that serves a run, entered before the run starts.

        :param run: a Run or a Team. The type is Any, because their modules import this one.
        """
        return nullcontext()

    def attend(self) -> None:
        """Answer clients. Called in the thread of the main loop."""

    def finish(self, result: RunResult) -> None:
        """Report the result of the run to clients."""


Stay: TypeAlias = "Callable[[RunResult, Sequence[RunServer]], Callable[[], bool]]"
"""Gets the result of a run and its staying servers; returns a test whether the user has ended them."""


def no_stay(_result: RunResult, _servers: Sequence[RunServer]) -> Callable[[], bool]:
    """End the servers with the run."""
    return lambda: True
