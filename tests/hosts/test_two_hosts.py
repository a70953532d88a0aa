"""Skiller on one host, executive on another, CURVE between them; without the right keys nobody gets in."""

from __future__ import annotations

import shutil
import signal
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import pytest

from cxbridge.blackboard.zmq.keyfiles import create_keys
from cxbridge.cli.main import invoke
from tests.fawkes import NO_SERVER
from tests.hosts.namespaces import Host, Program, two_hosts
from tests.support import ROOT, SHARED, needs_plugin

pytestmark = needs_plugin("fawkes")  # a run with a Skiller elsewhere

SCENARIO = ROOT / "scenarios" / "test-scenario"
RECORDING = SHARED / "traces" / "test-scenario" / "skiller-1" / "fawkes.log"
PATIENCE_S = 60.0
"""Bound of everything that ends by itself; far beyond what it takes."""

STRANGERS = {
    "insecure": ("?insecure=yes", "stays silent"),
    "unknown-client-key": (
        "?key={keys}/stranger.key_secret&server-key={keys}/robot.key",
        "a key is missing or wrong",
    ),
}
"""What is wrong, as the query of the URL, and a part of what is said of it."""


@pytest.fixture(scope="module")
def hosts() -> Iterator[tuple[Host, Host]]:
    with two_hosts() as made:
        yield made


@pytest.fixture(scope="module")
def keys(tmp_path_factory) -> Path:
    folder: Path = tmp_path_factory.mktemp("keys")
    for name in ("robot", "laptop", "stranger"):
        public, _ = create_keys(folder, name)
        if name == "laptop":
            (folder / "clients").mkdir()
            shutil.copy(public, folder / "clients")
    return folder


@dataclass
class Outcome:
    """How a program ended."""

    status: int
    output: str

    @classmethod
    def of(cls, program: Program) -> Self:
        """Wait until a program has ended."""
        return cls(program.end(PATIENCE_S), program.output)


@dataclass
class Evening:
    """The daemon served the scenario, and strangers knocked meanwhile."""

    scenario: Outcome
    strangers: dict[str, Outcome]
    daemon: Outcome
    log: Path


@pytest.fixture(scope="module")
def evening(hosts, keys, tmp_path_factory) -> Evening:
    robot, laptop = hosts
    folder: Path = tmp_path_factory.mktemp("logs")
    with serving(robot, keys, folder) as (daemon, url):
        ours = f"{url}?key={keys}/laptop.key_secret&server-key={keys}/robot.key"
        scenario = ("run", SCENARIO, "--log", folder / "run.log", "--skiller", ours)
        with ExitStack() as stack:
            run = stack.enter_context(laptop.cxbridge(*scenario, log=folder / "run.txt"))
            programs = {}
            for name, (query, _) in STRANGERS.items():
                theirs = ("bb", "list", "--connect", url + query.format(keys=keys))
                program = laptop.cxbridge(*theirs, log=folder / f"{name}.txt")
                programs[name] = stack.enter_context(program)
            strangers = {name: Outcome.of(program) for name, program in programs.items()}
            done = Outcome.of(run)
        daemon.process.send_signal(signal.SIGTERM)
        return Evening(done, strangers, Outcome.of(daemon), folder / "run.log")


@contextmanager
def serving(host: Host, keys: Path, folder: Path) -> Iterator[tuple[Program, str]]:
    """Run a daemon with keys on a host; yield it and its URL when it says, as to systemd, that it serves."""
    arguments = (*NO_SERVER, "--endpoint", f"tcp://{host.address}:*")
    own = ("--secret-key", keys / "robot.key_secret", "--clients", keys / "clients")
    env = {"NOTIFY_SOCKET": str(folder / "notify")}
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(env["NOTIFY_SOCKET"])
        listener.settimeout(PATIENCE_S)
        with host.cxbridge("daemon", *arguments, *own, log=folder / "daemon.txt", env=env) as daemon:
            said = ""
            while "READY=1" not in said:
                said = listener.recv(4096).decode()
            yield daemon, said.partition("serving at ")[2].split()[0]


def test_the_scenario_completes(evening):
    assert evening.scenario.status == 0, evening.scenario.output
    assert "every root goal ended COMPLETED" in evening.scenario.output


@pytest.mark.skipif(not RECORDING.is_file(), reason="the recordings (../shared) are absent")
def test_it_went_as_in_fawkes(evening, capsys):
    status = invoke(["trace", "diff", "--order", "partial", str(RECORDING), str(evening.log)])
    assert status == 0, capsys.readouterr().out


@pytest.mark.parametrize("name", STRANGERS)
def test_a_stranger_does_not_get_in(evening, name):
    outcome = evening.strangers[name]
    assert outcome.status == 2
    assert outcome.output.count("cxbridge: error:") == 1
    assert STRANGERS[name][1] in outcome.output
    assert "Traceback" not in outcome.output


def test_the_daemon_served_and_stopped(evening):
    assert evening.daemon.status == 0, evening.daemon.output
    assert "executes 'say" in evening.daemon.output
