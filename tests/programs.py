"""Commands of ``cxbridge`` beside a test: forked, with the interface of ``subprocess``."""

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
    """A started command with the interface of ``subprocess.Popen``: text, and an empty stdin.

    :param arguments: of ``cxbridge``.
    :param terminal: stdin, stdout and stderr of the command, in a new session.
    :param stdout: destination of the output.
    :param stderr: destination of the errors.
    :param environment: environment of the command; for None, that of this process.
    :param ignore: signal that the command ignores from its start, as its parent did.
    :ivar pid: number of the process.
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
        """The output, if piped."""
        assert self._out is not None
        return self._out

    @property
    def stderr(self) -> IO[str]:
        """The errors, if piped."""
        assert self._errors is not None
        return self._errors

    def wait(self, timeout: float | None = None) -> int:
        """Wait for the end of the command; return the exit status."""
        try:
            self.returncode = self._forked.wait(timeout)
        except TimeoutError:
            raise subprocess.TimeoutExpired(self.arguments, timeout or 0) from None
        return self.returncode

    def poll(self) -> int | None:
        """Return the exit status if the command has ended."""
        try:
            return self.wait(0)
        except subprocess.TimeoutExpired:
            return None

    def communicate(self, timeout: float | None = None) -> tuple[str, str]:
        """Wait for the end; return the rest of output and errors, and close the streams."""
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
        """Send a signal to the command, if it still runs."""
        self._forked.send_signal(number)

    def terminate(self) -> None:
        """Send SIGTERM to the command."""
        self._forked.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """Kill the command, if it still runs."""
        self._forked.kill()

    def _close(self) -> None:
        for stream in (self._out, self._errors):
            if stream:
                stream.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Kill the command, and wait for its end."""
        self.kill()
        self.wait()
        self._close()


def _opened(output: Output, theirs: ExitStack) -> tuple[int, IO[str] | None]:
    """Return the end of a stream for the command, and our end."""
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
