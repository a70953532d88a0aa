"""Commands of ``cxbridge`` as separate processes that need not load the program first.

A process with the loaded program waits, and forks for each command: the import would take half a second. From
its first statement to its exit status the command equals ``python -m cxbridge``. Only the modules are not
freed at the end, which would take longer than many a command. Use ``python -m cxbridge`` where start or end
matter: signals during the import, different settings of Python.
"""

from __future__ import annotations

import atexit
import gc
import importlib
import json
import os
import pkgutil
import select
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, BinaryIO, Final, NamedTuple, NoReturn, Self

import pytest

from tests.support import ROOT, TEST_FOLDERS

Program = str
"""``cxbridge`` or ``pytest``; another name is a module of the tests, of which ``main`` is called."""
IGNORED: Final = "ignore:Module already imported:pytest.PytestAssertRewriteWarning"
"""For ``-W`` of pytest: the process that was forked has our plug-in already."""
_STREAMS: Final = 3


class Nursery:
    """Starts the commands; ends the forking process on exit."""

    def __enter__(self) -> Self:
        self._socket, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", __name__, str(theirs.fileno())],
                cwd=ROOT,
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
            )
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()
        self._process.wait()

    def run(
        self,
        arguments: Sequence[str],
        *,
        folder: Path = ROOT,
        timeout: float = 120,
        program: Program = "cxbridge",
        environment: Mapping[str, str] | None = None,
    ) -> subprocess.CompletedProcess[bytes]:
        """Run a command with nothing to read until it ends.

        :param arguments: of the program.
        :param folder: working directory of the command.
        :param timeout: seconds after which the command is killed.
        :param environment: environment of the command; for None, that of this process.
        :raises TimeoutError: the command was killed.
        """
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as errors:
            with Path(os.devnull).open("rb") as nothing:
                streams = [stream.fileno() for stream in (nothing, out, errors)]
                forked = self._fork(arguments, folder, streams, program, environment=environment)
            with forked:
                status = forked.wait(timeout)
            for stream in (out, errors):
                stream.seek(0)
            return subprocess.CompletedProcess(list(arguments), status, out.read(), errors.read())

    def begin(
        self,
        arguments: Sequence[str],
        *,
        folder: Path = ROOT,
        session: bool = False,
        program: Program = "cxbridge",
    ) -> Piped:
        """Begin a command with open streams.

        :param arguments: of the program.
        :param folder: working directory of the command.
        :param session: whether the command leads a new session.
        """
        (its_in, stdin), (stdout, its_out), (stderr, its_errors) = os.pipe(), os.pipe(), os.pipe()
        try:
            forked = self._fork(arguments, folder, [its_in, its_out, its_errors], program, session=session)
        finally:
            for stream in (its_in, its_out, its_errors):
                os.close(stream)
        return Piped(forked, os.fdopen(stdin, "wb"), os.fdopen(stdout, "rb"), os.fdopen(stderr, "rb"))

    def _fork(
        self,
        arguments: Sequence[str],
        folder: Path,
        streams: Sequence[int],
        program: Program = "cxbridge",
        *,
        session: bool = False,
        environment: Mapping[str, str] | None = None,
        ignore: int | None = None,
    ) -> Forked:
        ours, theirs = socket.socketpair()
        with theirs:
            socket.send_fds(self._socket, [b"."], [*streams, theirs.fileno()])
        request = {
            "arguments": [program, *arguments],
            "folder": str(folder),
            "environment": dict(os.environ if environment is None else environment),
            "session": session,
            "ignore": ignore,
        }
        ours.sendall(json.dumps(request).encode() + b"\n")
        return Forked(ours)


class Forked:
    """A forked command. A context manager that kills the command.

    :ivar number: of the process.
    """

    def __init__(self, attendant: socket.socket) -> None:
        self._attendant = attendant
        self._answers = attendant.makefile("r")
        self.number: Final = int(self._answers.readline())
        self._status: int | None = None

    def wait(self, timeout: float | None = None) -> int:
        """Wait for the end of the command; return the exit status.

        :param timeout: seconds; None waits for ever.
        :raises TimeoutError: the command has not ended.
        """
        if self._status is None:
            if not select.select([self._attendant], [], [], timeout)[0]:
                raise TimeoutError
            self._status = int(self._answers.readline())
            self._close()
        return self._status

    @property
    def is_running(self) -> bool:
        """Whether the command still runs."""
        try:
            os.kill(self.number, 0)
        except ProcessLookupError:
            return False
        return self._status is None

    def send_signal(self, number: int) -> None:
        """Send a signal to the command, if it still runs."""
        if self._status is None:
            with suppress(ProcessLookupError):
                os.kill(self.number, number)

    def kill(self) -> None:
        """Kill the command, if it still runs."""
        self.send_signal(signal.SIGKILL)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()
        self._close()

    def _close(self) -> None:
        self._answers.close()
        self._attendant.close()


class Piped(NamedTuple):
    """A command, and our ends of its streams."""

    process: Forked
    stdin: BinaryIO
    stdout: BinaryIO
    stderr: BinaryIO


@cache
def nursery() -> Nursery:
    """Return the nursery of this process, which all tests share; it ends with the process."""
    made = Nursery().__enter__()
    atexit.register(made.__exit__)
    return made


def _become(request: dict[str, Any], streams: Sequence[int]) -> None:
    """Turn this process into that of the command."""
    if request["session"]:
        os.setsid()
    if request["ignore"] is not None:
        signal.signal(request["ignore"], signal.SIG_IGN)
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    os.chdir(request["folder"])
    os.environ.clear()
    os.environ.update(request["environment"])
    sys.argv = request["arguments"]
    for name, number in (("stdout", 1), ("stderr", 2)):
        before = getattr(sys, name)
        text = open(number, "w", 1, before.encoding, before.errors, closefd=False)  # noqa: SIM115
        setattr(sys, name, text)
        setattr(sys, f"__{name}__", text)


class _Serving:
    """Forks the requested commands, and sends the number and the status of each process to the requester.

    :param requests: the source of requests.
    """

    def __init__(self, requests: socket.socket) -> None:
        self._requests = requests
        self._askers: dict[int, socket.socket] = {}

    def serve(self) -> bool:
        """Return in the process of a command, or at the end of the requests."""
        signal.signal(signal.SIGCHLD, self._reap)
        while True:
            message, received, _, _ = socket.recv_fds(self._requests, 1, _STREAMS + 1)
            if not message:
                return False
            if self._begin(received):
                return True

    def _begin(self, received: Sequence[int]) -> bool:
        """Fork a command; return whether this process is the command."""
        *streams, number = received
        asker = socket.socket(fileno=number)
        with asker.makefile("r") as lines:
            request = json.loads(lines.readline())
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGCHLD})  # until the asker is known
        process = os.fork()
        if process == 0:
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGCHLD})
            for connection in (self._requests, asker, *self._askers.values()):
                connection.close()
            _become(request, streams)
            return True
        for stream in streams:
            os.close(stream)
        self._askers[process] = asker
        _tell(asker, process)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGCHLD})
        return False

    def _reap(self, *_: object) -> None:
        """Send the statuses of ended commands."""
        with suppress(ChildProcessError):
            while (ended := os.waitpid(-1, os.WNOHANG))[0]:
                process, status = ended
                with self._askers.pop(process) as asker:
                    _tell(asker, os.waitstatus_to_exitcode(status))


def _tell(asker: socket.socket, number: int) -> None:
    with suppress(OSError):  # the requester has ended
        asker.sendall(f"{number}\n".encode())


class _End:
    """Ends the process of a command after Python's work at exit except for the modules."""

    def __init__(self) -> None:
        self._status: int | None = None
        atexit.register(self)  # the first registered function is called last

    def run(self, command: Callable[[], int | None]) -> NoReturn:
        """Run the command; exit with its status."""
        try:
            sys.exit(command())
        except SystemExit as ended:
            if ended.code is None or isinstance(ended.code, int):  # else Python prints the error
                self._status = ended.code or 0
            raise

    def __call__(self) -> None:
        if self._status is not None:
            with suppress(OSError, ValueError):  # Python prints the error
                sys.stdout.flush()
                sys.stderr.flush()
                os._exit(self._status & 0xFF)


def main(number: int) -> None:
    end = _End()
    gc.disable()  # a collection would visit all loaded objects each time
    import cxbridge
    from cxbridge.cli.entry import main as run

    for module in pkgutil.walk_packages(cxbridge.__path__, "cxbridge."):
        with suppress(ImportError):  # of optional packages
            if not module.name.endswith("__main__"):
                importlib.import_module(module.name)
    if find_spec("cxbridge_studio"):
        from cxbridge.run.options import RunOptions
        from cxbridge_studio.check.run import check

        check(RunOptions(scenario=ROOT / "scenarios" / "test-scenario"))  # and the core's files are known
    gc.freeze()  # nor need a command's collector visit the shared objects
    gc.enable()
    if _Serving(socket.socket(fileno=number)).serve():
        name = sys.argv[0]
        own = {"cxbridge": run, "pytest": pytest.console_main}
        sys.path += [test_folder for test_folder in TEST_FOLDERS if test_folder not in sys.path]
        end.run(own[name] if name in own else importlib.import_module(name).main)


if __name__ == "__main__":
    main(int(sys.argv[1]))
