"""The processes of workers: fresh ones, which load the program, and copies of this one, which has it."""

from __future__ import annotations

import os
import random
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing import get_context
from typing import IO, Final, Protocol

from cxbridge.process import forking


class Connected(Protocol):
    """What is connected with this process."""

    def close_streams(self) -> None:
        """Let go of what connects us."""


class Fresh:
    """A worker in another Python.

    :ivar pid: its number.
    :ivar stdin: what it reads.
    :ivar stdout: what it answers.
    """

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "cxbridge.sweep.worker"], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self.stdin: Final[IO[bytes]] = self._process.stdin
        self.stdout: Final[IO[bytes]] = self._process.stdout
        self.pid: Final = self._process.pid

    def kill(self) -> None:
        """End it at once. From any thread."""
        self._process.kill()

    def wait(self) -> int:
        """Wait for its end; returns its status, or the negative number of a signal."""
        return self._process.wait()

    def close_streams(self) -> None:
        """Let go of what connects us."""
        _close(self)


class Copy:
    """A worker that is a copy of this process, which may have no other thread; see :class:`Fresh`.

    :param beside: the workers whose connections the copy lets go of: they end when this process does.
    """

    def __init__(self, beside: Sequence[Connected]) -> None:
        its_in, stdin = os.pipe()
        stdout, its_out = os.pipe()
        self.stdin: Final[IO[bytes]] = os.fdopen(stdin, "wb")
        self.stdout: Final[IO[bytes]] = os.fdopen(stdout, "rb")
        method = "fork"  # Windows has none
        # one that is a daemon does not outlive us
        self._process = get_context(method).Process(  # type: ignore[attr-defined,unused-ignore]
            target=_be_worker, args=(its_in, its_out, [*beside, self]), daemon=True
        )
        try:
            self._process.start()
        except BaseException:
            self.close_streams()
            raise
        finally:
            os.close(its_in)
            os.close(its_out)
        self.pid: Final[int] = self._process.pid

    def kill(self) -> None:
        """End it at once. From any thread."""
        self._process.kill()

    def wait(self) -> int:
        """Wait for its end; returns its status, or the negative number of a signal."""
        self._process.join()
        status: int = self._process.exitcode
        return status

    def close_streams(self) -> None:
        """Let go of what connects us."""
        _close(self)


def _close(process: Fresh | Copy) -> None:
    for stream in (process.stdin, process.stdout):
        with suppress(OSError):
            stream.close()


def _be_worker(seeds: int, rows: int, others: Sequence[Connected]) -> None:
    """Be a worker, in a copy; what the run prints goes to standard error."""
    from cxbridge.sweep.worker import WorkerChannel, serve  # noqa: PLC0415 - who sweeps in a cluster needs none of it

    forking.let_signals_end()  # who sweeps has got Ctrl-C, too, and ends us
    random.seed()  # each worker draws others, as one that is no copy
    for each in others:
        each.close_streams()
    os.dup2(2, 1)
    with os.fdopen(seeds, "rb") as reading, os.fdopen(rows, "wb") as writing:
        serve(WorkerChannel(reading, writing))
