"""Programs for a server and clients in separate processes: ``python -m ... ROLE HOST PORT``.

A program prints ``ready PORT``, prints the result of the command in each line of its input, and ends with
the input.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from typing import Any, Self

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import RealClock
from cxbridge.events import EventBus
from cxbridge.interfaces import default_registry
from cxbridge.skiller.simulation.estimators import StaticEstimator
from cxbridge.skiller.simulation.simulator import SkillerSimulator
from cxbridge_fawkes.network import sockets
from cxbridge_fawkes.network.client import FawkesBlackBoard
from cxbridge_fawkes.network.server import FawkesServer
from tests.support import ROOT, TEST_FOLDERS

TIMEOUT = 60.0
"""Timeout in seconds of operations that are normally fast."""


class Child:
    """A process with one of the programs.

    :param wrap: returns the command that starts the program, perhaps in a different network namespace.
    """

    def __init__(
        self, *arguments: object, wrap: Callable[..., list[str]] = lambda *words: list(words)
    ) -> None:
        command = wrap(sys.executable, "-m", __name__, *map(str, arguments))
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join((str(ROOT), *TEST_FOLDERS))}
        self.process = subprocess.Popen(
            command, cwd=ROOT, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.port = int(self._line().split()[1])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.communicate(timeout=TIMEOUT)

    def _line(self) -> str:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        assert line, f"the program ended with {self.process.wait(TIMEOUT)}"
        return line.strip()

    def ask(self, command: str) -> Any:
        """Send a command, and return the result."""
        assert self.process.stdin is not None
        self.process.stdin.write(f"{command}\n")
        self.process.stdin.flush()
        return json.loads(self._line())

    def stop(self) -> None:
        """Stop the process, as a debugger does."""
        self.process.send_signal(signal.SIGSTOP)

    def resume(self) -> None:
        """Continue the stopped process."""
        self.process.send_signal(signal.SIGCONT)


def print_line(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def run_commands(port: int, commands: dict[str, Callable[..., Any]]) -> None:
    """Run the commands of the input."""
    print_line(f"ready {port}")
    for line in sys.stdin:
        command, *arguments = line.split()
        print_line(json.dumps(commands[command](*map(int, arguments))))


def serve(host: str, gone_s: str) -> None:
    """Serve a blackboard with a writer and a Skiller."""
    clock = RealClock()
    board = LocalBlackBoard(default_registry(), clock, EventBus(clock))
    writer: Any = board.open_for_writing("TestInterface", "served")
    skiller = SkillerSimulator(board, clock, EventBus(clock), [StaticEstimator(seconds=3600.0)])
    control: Any = board.open_for_reading("SkillerInterface", "Skiller")
    stopped = threading.Event()

    def loop() -> None:
        while not stopped.wait(0.01):
            skiller.loop()

    def write(number: int) -> int:
        writer.test_int = number
        writer.write()
        return number

    def controller() -> str:
        control.read()
        return str(control.exclusive_controller)

    sockets.GONE_TIMEOUT_S = float(gone_s)  # type: ignore[misc] # shorter in tests
    allow = () if host == "127.0.0.1" else ("10.0.0.0/8",)
    looping = threading.Thread(target=loop)
    looping.start()
    with FawkesServer(board, host, 0, allow=allow) as server:
        run_commands(
            server.port,
            {
                "write": write,
                "clients": lambda: len(server._sessions),
                "list": lambda: {info.uid: (info.has_writer, info.num_readers) for info in board.list()},
                "controller": controller,
            },
        )
    stopped.set()
    looping.join()


def connect(host: str, port: str) -> FawkesBlackBoard:
    return FawkesBlackBoard(f"fawkes://{host}:{port}", default_registry(), RealClock(), timeout=TIMEOUT)


def client(host: str, port: str) -> None:
    """Read the served interfaces, write a further interface, control the Skiller on request."""
    with connect(host, port) as board:
        reader: Any = board.open_for_reading("TestInterface", "served")
        writer: Any = board.open_for_writing("TestInterface", "written")
        skiller: Any = board.open_for_reading("SkillerInterface", "Skiller")

        def write(number: int) -> int:
            writer.test_int = number
            writer.write()
            board.flush()
            return number

        def read() -> int:
            board.flush()
            reader.read()
            return int(reader.test_int)

        def acquire() -> int:
            number = skiller.msgq_enqueue(skiller.create_message("AcquireControlMessage"))
            board.flush()
            return int(number)

        run_commands(int(port), {"write": write, "read": read, "acquire": acquire})


def silent(host: str, port: str) -> None:
    """Open an interface for writing, without a write and without reading messages."""
    with connect(host, port) as board:
        board.open_for_writing("TestInterface", "silent")
        run_commands(int(port), {})


def main(arguments: Sequence[str]) -> None:
    {"serve": serve, "client": client, "silent": silent}[arguments[0]](*arguments[1:])


if __name__ == "__main__":
    main(sys.argv[1:])
