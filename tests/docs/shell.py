"""Runs the commands of a page as a user would.

``cxbridge`` runs in this process, which is ten times as fast as a new process; pipes, further programs and
commands with ``&`` are real processes. A daemon in the background gets free ports, to which commands for a
daemon, or for the robot's Fawkes, connect.
"""

from __future__ import annotations

import os
import re
import shlex
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Self

from cxbridge.cli.main import invoke
from tests.forked import IGNORED, nursery
from tests.programs import Started
from tests.support import free_port

WAIT_S = 60
"""Seconds after which a command has failed."""

_EXIT = re.compile(r"\s+# exit status (\d+)$")
_COMMENT = re.compile(r"\s+# .*$")
_FAWKES_URL = re.compile(r"fawkes://(?:robot|localhost):1910")
_ENDPOINT = "tcp://127.0.0.1:1911"
_READY = re.compile(r": Ready\b")
_KILL = re.compile(r"kill %(\d+)$")
_SERVED = re.compile(r"Serving the blackboard at (\S+)")
_SHELL = re.compile(r"[|>&;$~]")
_QUOTED = re.compile(r"'[^']*'|\"[^\"$]*\"")
"""Characters without a meaning for the shell."""
_PYTEST_ALONE = {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTEST_PLUGINS": "cxbridge.pytest_plugin"}
"""Only the plug-ins of cxbridge and pytest: further plug-ins cost two seconds per start."""


class Background:
    """A program that was started with ``&``; the next command waits until the program is ready.

    :param program: ``cxbridge`` or ``python``.
    """

    def __init__(self, program: str, arguments: list[str], folder: Path) -> None:
        self.text = shlex.join([program, *arguments])
        self.lines: list[str] = []
        self._ready = threading.Event()
        self._process: Started | subprocess.Popen[str]
        if program == "cxbridge":
            self._process = Started(*arguments, stdout=subprocess.DEVNULL, folder=folder)
        else:
            self._process = subprocess.Popen(
                [sys.executable, *arguments],
                cwd=folder,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
            )
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stderr is not None
        for line in self._process.stderr:
            self.lines.append(line.rstrip())
            if _READY.search(line):
                self._ready.set()
        self._ready.set()

    def wait_until_ready(self) -> None:
        assert self._ready.wait(WAIT_S), (self.text, self.lines)
        assert any(_READY.search(line) for line in self.lines), (self.text, self.lines)

    @property
    def urls(self) -> list[str]:
        """The address of its blackboard."""
        return [match[1] for line in self.lines if (match := _SERVED.search(line))]

    def terminate(self) -> None:
        """End the program as ``kill`` does."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGTERM)

    def end(self) -> int:
        """Wait for the end of the program; return the exit status."""
        try:
            return self._process.wait(WAIT_S)
        finally:
            self._process.kill()
            self._reader.join(WAIT_S)
            assert self._process.stderr is not None
            self._process.stderr.close()


class Shell:
    """One terminal in one folder; to be used with ``with``, in that folder.

    :param folder: the working directory.
    :param ipc: a folder with a short name for the daemon's socket.
    :param setenv: sets a variable of this process until the end of the test.
    :param names: names in the manual for paths of this machine, e.g. ``~/fawkes``.
    """

    def __init__(
        self,
        folder: Path,
        ipc: Path,
        setenv: Callable[[str, str], None],
        names: Mapping[str, str] | None = None,
    ) -> None:
        self._folder, self._ipc, self._setenv = folder, ipc, setenv
        self._names = dict(names or {})
        self._running: list[Background] = []
        self._fawkes_url = ""
        self._endpoint = f"tcp://127.0.0.1:{free_port()}"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        for program in self._running:
            program.terminate()
        for program in self._running:
            program.end()

    def run(self, line: str) -> None:
        """Run a line. Its exit status has to be 0, or that of a comment ``# exit status N``."""
        match = _EXIT.search(line)
        expected = int(match[1]) if match else 0
        text = _COMMENT.sub("", line)
        for name, meant in self._names.items():
            text = text.replace(name, meant)
        text = text.replace(_ENDPOINT, self._endpoint)
        if self._fawkes_url:
            text = _FAWKES_URL.sub(self._fawkes_url, text)
        if text.endswith(" &"):
            self._start(shlex.split(text.removesuffix(" &")))
            return
        if job := _KILL.match(text):
            self._running[int(job[1]) - 1].terminate()
            assert self._running[int(job[1]) - 1].end() in (0, -signal.SIGTERM), line
            return
        status = self._status(text)
        assert status == expected, (line, status)
        if text.startswith("cxbridge daemon shutdown"):
            assert self._running[0].end() == 0, line

    def _status(self, text: str) -> int:
        words = shlex.split(text)
        if words[0] == "cxbridge" and not _SHELL.search(_QUOTED.sub("", text)):
            return invoke(words[1:])
        environment = os.environ | _PYTEST_ALONE
        if words[0] == "pytest" and not _SHELL.search(text):
            command = [*words[1:], "-W", IGNORED]
            forked = nursery().run(command, folder=self._folder, program="pytest", environment=environment)
            sys.stdout.write(forked.stdout.decode())
            sys.stderr.write(forked.stderr.decode())
            return forked.returncode
        environment["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{environment['PATH']}"
        done = subprocess.run(
            ["bash", "-c", text],
            check=False,
            cwd=self._folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=2 * WAIT_S,
        )
        sys.stdout.write(done.stdout)
        sys.stderr.write(done.stderr)
        return done.returncode

    def _start(self, words: list[str]) -> None:
        program, *arguments = words
        assert program in ("cxbridge", "python"), words
        if program == "cxbridge" and arguments[0] == "daemon":
            arguments += ["--fawkes-port", "0"]
            if "--endpoint" not in arguments:
                url = f"ipc://{self._ipc / 'daemon'}"
                arguments += ["--endpoint", url]
                self._setenv("CXBRIDGE_CONNECT", url)
        self._running.append(Background(program, arguments, self._folder))
        self._running[-1].wait_until_ready()
        for url in self._running[-1].urls:
            if url.startswith("fawkes://"):
                self._fawkes_url = url
