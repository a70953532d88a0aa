"""Two hosts on one machine: network namespaces with a cable between them, and nothing else."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Self

import pytest

from tests.support import ROOT

TOOLS = ("ip", "unshare", "nsenter")
ADDRESSES = ("10.77.0.1", "10.77.0.2")


class Host:
    """A network namespace.

    It belongs to a process that waits for the end of its input, so that it vanishes with these tests however
    they end.

    :raises OSError: when namespaces may not be made.
    """

    def __init__(self, address: str) -> None:
        self.address = address
        self._holder = subprocess.Popen(
            ["unshare", "--net", "sh", "-c", "echo ready; exec cat"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self._holder.stdout is not None
        if self._holder.stdout.readline() != "ready\n":
            raise OSError(self._holder.communicate()[1].strip())

    @property
    def pid(self) -> int:
        """Of the process that has the namespace."""
        return self._holder.pid

    def close(self) -> None:
        """Let the namespace vanish, and the cable with it."""
        self._holder.communicate(timeout=10)

    def command(self, *arguments: str) -> list[str]:
        """Return the command that does ``arguments`` on this host."""
        return ["nsenter", f"--net=/proc/{self.pid}/ns/net", *arguments]

    def do(self, *arguments: str) -> None:
        """Run a command here.

        :raises OSError: when it fails.
        """
        done = subprocess.run(
            self.command(*arguments), capture_output=True, text=True, check=False, timeout=10
        )
        if done.returncode:
            raise OSError(f"{' '.join(arguments)}: {done.stderr.strip()}")

    def cxbridge(self, *arguments: str | Path, log: Path, env: dict[str, str] | None = None) -> Program:
        """Start the program on this host, its output in ``log``."""
        return Program(self.command(sys.executable, "-m", "cxbridge", *map(str, arguments)), log, env or {})


class Program:
    """A running command; as a context manager it is killed at the end, if it still runs."""

    def __init__(self, command: Sequence[str], log: Path, env: dict[str, str]) -> None:
        self._log = log
        with log.open("w") as output:
            self.process = subprocess.Popen(
                command,
                cwd=ROOT,
                env=os.environ | {"PYTHONPATH": str(ROOT)} | env,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(timeout=10)

    @property
    def output(self) -> str:
        """What it has printed."""
        return self._log.read_text()

    def end(self, seconds: float) -> int:
        """Return its exit status; it fails when it takes longer than ``seconds``."""
        return self.process.wait(timeout=seconds)


@contextmanager
def two_hosts() -> Iterator[tuple[Host, Host]]:
    """Make two hosts with a cable between them; skip the test where that is not allowed."""
    missing = [tool for tool in TOOLS if shutil.which(tool) is None]
    if missing:
        pytest.skip(f"two hosts need {', '.join(missing)}")
    if os.geteuid() != 0:
        pytest.skip("only root may make network namespaces")
    with ExitStack() as stack:
        try:
            hosts = []
            for address in ADDRESSES:
                hosts.append(Host(address))
                stack.callback(hosts[-1].close)
            _connect(*hosts)
        except OSError as error:
            pytest.skip(f"network namespaces cannot be made here: {error}")
        yield hosts[0], hosts[1]


def _connect(one: Host, other: Host) -> None:
    one.do("ip", "link", "add", "cable", "type", "veth", "peer", "name", "cable", "netns", str(other.pid))
    for host in (one, other):
        host.do("ip", "address", "add", f"{host.address}/24", "dev", "cable")
        host.do("ip", "link", "set", "lo", "up")
        host.do("ip", "link", "set", "cable", "up")
