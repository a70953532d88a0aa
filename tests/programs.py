"""Commands of ``cxbridge`` that go on beside a test: what ``subprocess`` has for them, but forked."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Final, Self

from tests.forked import nursery
from tests.support import ROOT

Output = int | IO[bytes] | IO[str]
"""As for ``subprocess``: ``PIPE``, ``DEVNULL``, ``STDOUT``, a descriptor or a file."""


class Started:
    """A command that was started, as ``subprocess.Popen`` has it: text, and nothing to read.

    :param arguments: of ``cxbridge``.
    :param terminal: where it reads, and prints and says everything, in a session of its own.
    :param stdout: where its output goes.
    :param stderr: where its errors go.
    :param environment: its own one; for None, that of this process.
    :param ignore: a signal that it ignores from its start, as its parent did.
    :ivar pid: number of its process.
    """

    def __init__(
        self,
        *arguments: object,
        terminal: int | None = None,
        stdout: Output = subprocess.PIPE,
        stderr: Output = subprocess.PIPE,
        folder: Path = ROOT,
        environment: Mapping[str, str] | None = None,
        ignore: int | None = None,
    ) -> None:
        self.arguments: Final = [
            os.fspath(argument) if isinstance(argument, Path) else str(argument) for argument in arguments
        ]
        self._out: IO[str] | None = None
        self._errors: IO[str] | None = None
        with ExitStack() as theirs:
            if terminal is not None:
                streams = [terminal] * 3
            else:
                nothing = theirs.enter_context(Path(os.devnull).open("rb"))
                out, self._out = _opened(stdout, theirs)
                errors, self._errors = (out, None) if stderr == subprocess.STDOUT else _opened(stderr, theirs)
                streams = [nothing.fileno(), out, errors]
            self._forked = nursery()._fork(
                self.arguments,
                folder,
                streams,
                session=terminal is not None,
                environment=environment,
                ignore=ignore,
            )
        self.pid: Final = self._forked.number
        self.returncode: int | None = None

    @property
    def stdout(self) -> IO[str]:
        """Its output, if it goes here."""
        assert self._out is not None
        return self._out

    @property
    def stderr(self) -> IO[str]:
        """Its errors, if they go here."""
        assert self._errors is not None
        return self._errors

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end; returns the exit status."""
        try:
            self.returncode = self._forked.wait(timeout)
        except TimeoutError:
            raise subprocess.TimeoutExpired(self.arguments, timeout or 0) from None
        return self.returncode

    def poll(self) -> int | None:
        """Return the exit status if it has ended."""
        try:
            return self.wait(0)
        except subprocess.TimeoutExpired:
            return None

    def communicate(self, timeout: float | None = None) -> tuple[str, str]:
        """Wait for its end; returns what else it printed and said. The streams are closed then."""
        texts = ["", ""]

        def read(index: int, stream: IO[str]) -> None:
            texts[index] = stream.read()

        streams = [stream if stream and not stream.closed else None for stream in (self._out, self._errors)]
        readers = [
            threading.Thread(target=read, args=(index, stream), daemon=True)
            for index, stream in enumerate(streams)
            if stream
        ]
        for reader in readers:
            reader.start()
        self.wait(timeout)
        for reader in readers:
            reader.join(timeout)
        self._close()
        return texts[0], texts[1]

    def send_signal(self, number: int) -> None:
        """Send it a signal, if it has not ended."""
        self._forked.send_signal(number)

    def terminate(self) -> None:
        """Ask it to end."""
        self._forked.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """Kill it, if it has not ended."""
        self._forked.kill()

    def _close(self) -> None:
        for stream in (self._out, self._errors):
            if stream:
                stream.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Kill it, and wait for its end."""
        self.kill()
        self.wait()
        self._close()


def _opened(output: Output, theirs: ExitStack) -> tuple[int, IO[str] | None]:
    """Return the end that the command gets, and the one that is for us."""
    if not isinstance(output, int):
        return output.fileno(), None
    if output == subprocess.PIPE:
        ours, its = os.pipe()
        theirs.callback(os.close, its)
        return its, os.fdopen(ours, "r")
    if output == subprocess.DEVNULL:
        its = os.open(os.devnull, os.O_WRONLY)
        theirs.callback(os.close, its)
        return its, None
    return output, None
