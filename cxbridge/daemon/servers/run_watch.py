"""What serves a run for those who watch it, its page and Foxglove, until they have seen enough."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import TYPE_CHECKING, Final, Protocol

if TYPE_CHECKING:
    from cxbridge.run.assembly import Assembly
    from cxbridge.run.result import RunResult
    from cxbridge.run.team import Team

REST_S: Final = 0.02
"""Seconds between two looks at what clients want while the loop rests."""


class RunServer(Protocol):
    """Something that serves a run."""

    def serve(self, run: Assembly | Team) -> AbstractContextManager[object]:
        """Serve a run that is made and not started, until the context is left."""

    def attend(self) -> None:
        """Do what clients want, in the main loop's thread."""

    def finish(self, result: RunResult) -> None:
        """Note that the run has come to its end."""


class RunWatch:
    """A run's company: its servers, which stay after its end until somebody has seen enough.

    :param on_end: gets the result, before the servers are kept.
    :param has_seen_enough: whether to end them.
    """

    def __init__(
        self,
        servers: Sequence[RunServer],
        on_end: Callable[[RunResult], None],
        has_seen_enough: Callable[[], bool],
    ) -> None:
        self._servers = servers
        self._on_end = on_end
        self._has_seen_enough = has_seen_enough

    @contextmanager
    def join(self, run: Assembly | Team) -> Iterator[None]:
        """Serve a run."""
        with ExitStack() as stack:
            for server in self._servers:
                stack.enter_context(server.serve(run))
            yield

    def stay(self, result: RunResult, is_over: Callable[[], bool], tick: Callable[[], None]) -> None:
        """Keep the servers."""
        for server in self._servers:
            server.finish(result)
        self._on_end(result)
        while not (is_over() or self._has_seen_enough()):
            for server in self._servers:
                server.attend()
            tick()
            time.sleep(REST_S)
