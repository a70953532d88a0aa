"""Programs are stopped by signals at random instants from their start; the remains are checked.

COUNT stops by each of SIGTERM, SIGINT and SIGHUP of each program: run, daemon, gateway, executor, record,
monitor. Half of them come during the start. The claims:

- *documented status*: that of docs/commands.md; or that of a program before its import, if the signal
  precedes all output and files;
- *nothing is left*: no socket, no lock, no temporary file, no process, no screen of a terminal;
- *recordings are readable*, all of them;
- *no traceback*.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import termios
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from cxbridge.errors import CxbridgeError
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.trace.formats.files import open_exclusively
from cxbridge.trace.formats.registry import open_run
from tests.fawkes import HAS_FAWKES, NO_SERVER

SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
INTERRUPTED = 130
MOST_S = 60.0
RUNS_S = 2.0
"""Seconds after the start of a program in which the second half of the signals comes."""

_ENTER, _LEAVE = b"\x1b[?1049h", b"\x1b[?1049l"
_INTERRUPTED_TEXT = b"cxbridge: interrupted\n"
_PYTHON_IS_STARTING = (b"Fatal Python error: init_import_site", b"Could not import runpy module")
"""Python's message when SIGINT ends Python's start, before any line of ours; the status is 1."""

_EXECUTOR = """
from cxbridge.skiller.board.executor import SkillExecutor


class Idle(SkillExecutor):
    skills = ("rest",)

    def execute(self, call):
        yield
"""


@dataclass(frozen=True)
class Program:
    """A program to stop.

    :param arguments: of ``cxbridge``; ``{here}`` is the folder of the trial, ``{left}`` and ``{right}`` are
        two blackboards.
    :param statuses: the documented statuses.
    :param ready: text on stderr after the start; empty for a program that draws a screen.
    :param recordings: files that the program may leave in the folder ``out``.
    """

    arguments: Sequence[str]
    statuses: frozenset[int]
    ready: bytes
    recordings: Sequence[str] = ()


PROGRAMS = {
    "run": Program(
        (
            "run",
            "test-scenario",
            "--clock",
            "real",
            "--trace",
            "{here}/out/t.mcap",
            "--log",
            "{here}/out/t.log",
            "-v",
        ),
        frozenset({INTERRUPTED}),
        b"Calling skill",
        ("t.mcap", "t.log"),
    ),
    "daemon": Program(
        (
            *("daemon", "test-scenario", "--endpoint", "ipc://{here}/bb", *NO_SERVER),
            *("--trace", "{here}/out/t.mcap", "--log", "{here}/out/t.log"),
            *(("--bblog", "{here}/out/bb") if HAS_FAWKES else ()),
        ),
        frozenset({0}),
        b"Daemon: Ready",
        ("t.mcap", "t.log", "bb"),
    ),
    "executor": Program(
        ("skill", "executor", "{here}/idle.py:Idle", "--agent", "r", "--connect", "{left}"),
        frozenset({0}),
        b"Ready:",
    ),
    "record": Program(
        (
            "trace",
            "record",
            "-i",
            "*",
            "-o",
            "{here}/out/t.mcap",
            "-o",
            "{here}/out/bb",
            "--connect",
            "{left}",
        ),
        frozenset({0}),
        b"Ready:",
        ("t.mcap", "bb"),
    ),
    "monitor": Program(("monitor", "--connect", "{left}"), frozenset({INTERRUPTED}), b""),
}
if HAS_FAWKES:
    PROGRAMS["gateway"] = Program(("gateway", "{left}", "{right}", "-i", "*"), frozenset({0}), b"Ready:")


class Trial:
    """A program from its start to its end.

    :param boards: the URLs of two blackboards.
    """

    def __init__(self, program: Program, here: Path, boards: Sequence[str]) -> None:
        self.program, self.here = program, here
        for name in ("tmp", "out"):
            (here / name).mkdir(parents=True)
        (here / "idle.py").write_text(_EXECUTOR)
        names = {"here": here, "left": boards[0], "right": boards[-1]}
        command = [sys.executable, "-m", "cxbridge", *(text.format(**names) for text in program.arguments)]
        self._terminal, slave = os.openpty()
        self._settings = termios.tcgetattr(slave)
        shows = not program.ready
        self._errors = (here / "stderr").open("w+b")
        env = os.environ | {"TMPDIR": str(here / "tmp"), "TERM": "xterm-256color", "COLUMNS": "100"}
        self._slave = slave
        self.process = subprocess.Popen(
            command,
            cwd=here,
            env=env,
            stdin=slave if shows else subprocess.DEVNULL,
            stdout=slave if shows else subprocess.DEVNULL,
            stderr=self._errors,
            start_new_session=True,
        )
        os.set_blocking(self._terminal, False)
        self.screen = b""

    def _read(self) -> None:
        with suppress(BlockingIOError):
            while self._terminal >= 0:
                self.screen += os.read(self._terminal, 65536)

    def look(self) -> bytes:
        """Return the output so far."""
        self._read()
        return (self.here / "stderr").read_bytes() + self.screen

    def wait(self, until: Callable[[], bool], most_s: float) -> bool:
        """Wait for a condition while the terminal is read; return whether the condition holds."""
        end_s = time.monotonic() + most_s
        while not until():
            if time.monotonic() >= end_s:
                return False
            time.sleep(0.01)
        return True

    def is_ready(self) -> bool:
        """Return whether the program has started, or ended."""
        mark = self.program.ready or _ENTER
        return mark in self.look() or self.has_ended()

    def has_ended(self) -> bool:
        """Return whether the program has ended; reads the terminal."""
        self._read()
        return self.process.poll() is not None

    def close(self) -> None:
        """End the program, if it still runs."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self._errors.close()
        os.close(self._terminal)
        os.close(self._slave)

    def faults(self, number: signal.Signals) -> Iterator[str]:
        """Yield the faults after the end of the program."""
        said, status = self.look(), self.process.returncode
        early = self.is_early(number)
        if status not in self.program.statuses and not early:
            yield f"status {status}: {said[-2000:].decode(errors='replace')}"
        if (b"Traceback" in said or b"Exception ignored" in said) and not early:
            yield f"a traceback: {said.decode(errors='replace')}"
        if said.count(_ENTER) != said.count(_LEAVE) or self._settings != termios.tcgetattr(self._slave):
            yield "the terminal is not as it was"
        known = {"tmp", "out", "stderr", "idle.py", "__pycache__"}
        left = [str(path) for path in self.here.iterdir() if path.name not in known]
        yield from (f"left behind: {path}" for path in (*left, *(self.here / "tmp").iterdir()))
        try:
            os.killpg(self.process.pid, 0)
        except ProcessLookupError:
            pass
        else:
            yield "a process of it is still there"
            os.killpg(self.process.pid, signal.SIGKILL)
        for path in (self.here / "out").iterdir():
            if path.name not in self.program.recordings:
                yield f"left behind: {path}"
            yield from _check_recording(path)

    def is_early(self, number: signal.Signals) -> bool:
        """Return whether the signal precedes all output and files of the program."""
        said, status = self.look(), self.process.returncode
        if number is signal.SIGINT:
            if status == 1 and said.startswith(_PYTHON_IS_STARTING):
                return True  # Python had not begun either
            # a message of Python during its start; or of our modules during their import
            own = said.startswith(b"Traceback") and said.endswith(b"\nKeyboardInterrupt\n")
            # after a signal within an exec() Python still ends by the signal: a shell has 130 for both
            if (own and status == -number) or said == _INTERRUPTED_TEXT:
                said = b""
        return not said and status in {-number, INTERRUPTED} and not any((self.here / "out").iterdir())


def _check_recording(path: Path) -> Iterator[str]:
    files = sorted(path.iterdir()) if path.is_dir() else [path]
    for file in files:
        try:
            recorded = open_run(file, InterfaceRegistry())
            list(recorded)
            yield from (f"{file.name}: {note}" for note in recorded.notes)
            open_exclusively(file).close()  # the lock is free
        except CxbridgeError as error:
            if file.suffix == ".log" and "is empty" in str(error):
                continue  # nothing was logged
            yield f"{file.name} cannot be read: {error}"


def run(program: Program, boards: Sequence[str], count: int, seed: int) -> list[str]:
    """Stop a program repeatedly; return the faults.

    :param boards: the URLs of two blackboards.
    :param count: stops by each signal.
    """
    faults, dice, took_s = list[str](), random.Random(seed), 1.0
    for number in SIGNALS:  # programs get the signals that a shell or nohup makes us ignore
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
    for index, number in product(range(count), SIGNALS):
        with tempfile.TemporaryDirectory() as folder, closing(Trial(program, Path(folder), boards)) as trial:
            delay_s = dice.random() * took_s
            if index % 2:
                began_s = time.monotonic()
                trial.wait(trial.is_ready, MOST_S)
                took_s = max(0.2, time.monotonic() - began_s)
                delay_s = dice.random() * RUNS_S
            trial.wait(trial.has_ended, delay_s)
            trial.process.send_signal(number)
            if trial.wait(trial.has_ended, MOST_S):
                found = list(trial.faults(number))
            else:
                found = [f"does not end within {MOST_S:g} s: {trial.look().decode(errors='replace')}"]
            faults += [f"{number.name}, after {delay_s:.3f} s: {each}" for each in found]
    return faults
