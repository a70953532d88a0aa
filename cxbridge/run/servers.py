"""Servers of a run for clients that watch it. Option groups of plug-ins add servers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Any, ClassVar, Final, TypeAlias

if TYPE_CHECKING:
    from cxbridge.run.result import RunResult


ATTEND_PAUSE_S: Final = 0.02
"""Seconds between two calls of :meth:`RunServer.attend` while the main loop is paused or has ended.

Shorter than the default period of the main loop.
"""


class RunServer:
    """A server of a run. Subclasses override the methods they need."""

    lingering_name: ClassVar[str] = ""
    """The name of a server that continues after the run, e.g. ``the page``; empty if it ends with the run."""

    def serve(self, run: Any) -> AbstractContextManager[object]:  # noqa: ARG002 - for subclasses
        """Return a context manager that serves a run, entered before the run starts.

        :param run: a Run or a Team. The type is Any, because their modules import this one.
        """
        return nullcontext()

    def attend(self) -> None:
        """Answer clients. Called in the thread of the main loop; by the run only after its end."""

    def finish(self, result: RunResult) -> None:
        """Report the result of the run to clients."""


WaitForUser: TypeAlias = "Callable[[RunResult, Sequence[RunServer]], Callable[[], bool]]"
"""A function that is called when a run has ended and at least one of its servers continues.

It gets the result and all servers; those with a :attr:`RunServer.lingering_name` continue. It returns a
function that is called until it returns True, when the user has ended the servers. The type is a string,
because the class of the result is only imported for type checks.
"""


def end_with_run(_result: RunResult, _servers: Sequence[RunServer]) -> Callable[[], bool]:
    """Return a function that ends the servers at once; a :data:`WaitForUser`."""
    return lambda: True
