"""The daemon in this process and in a separate process: settings, state, commands."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from cxbridge.blackboard.kit.errors import RemoteRefusalError
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.clock import RealClock
from cxbridge.config import Configuration
from cxbridge.daemon.client import read_status, send_command
from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.options import DaemonOptions
from cxbridge.daemon.settings import DaemonSettings
from cxbridge.errors import BlackBoardError, ConfigError, CxbridgeError
from cxbridge.interfaces import InterfaceRegistry, SkillerInterface
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.sources import run_sources
from tests.fawkes import ANY_PORT, HAS_FAWKES, TRANSPORT
from tests.programs import Started
from tests.run.mini import write_scenario
from tests.support import ROOT, needs_all_plugins

WAIT_S = 20
QUIET: tuple[tuple[str, Any], ...] = (("fawkes/enable", False), ("zmq/endpoints", []))


def settings(text, **changes):
    config = Configuration.from_text(text, "/there/cxbridge.yaml")
    for path, value in changes.items():
        config.set(path, value)
    return DaemonSettings.from_config(config)


@contextmanager
def running(options=None, **named):
    """A daemon that runs in a thread."""
    lines: list[str] = []
    daemon_ready = threading.Event()

    def note(line: Any) -> None:
        lines.append(line.text)
        if line.text == "Ready":
            daemon_ready.set()

    daemon = Daemon(options or DaemonOptions(**named), note)
    outcome: list[Any] = []

    def run():
        try:
            outcome.append(daemon.run())
        except CxbridgeError as error:
            outcome.append(error)
            daemon_ready.set()

    thread = threading.Thread(target=run)
    thread.start()
    try:
        assert daemon_ready.wait(WAIT_S)
        yield daemon, lines, outcome
    finally:
        daemon.stop()
        thread.join(WAIT_S)
        assert not thread.is_alive()


def connected(daemon):
    return open_blackboard(daemon.endpoints[0], InterfaceRegistry(), RealClock())


# -- settings


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        (
            "cxbridge:\n  skillr: lua\n",
            "/cxbridge/skillr is not a setting of a daemon",
            "did you mean skiller?",
        ),
        ("cxbridge:\n  skiller: butler\n", "/cxbridge/skiller cannot be 'butler'", "lua, simulator, none"),
        ("cxbridge:\n  on-failure: cry\n", "/cxbridge/on-failure cannot be 'cry'", "continue, stop"),
        ("cxbridge:\n  executive: perhaps\n", "/cxbridge/executive must be true or false", None),
        ("cxbridge:\n  clock: virtual\n", "cannot run on a virtual clock", "real"),
        ("cxbridge:\n  zmq: {clients: keys}\n", "CURVE needs both settings", "make keys"),
    ],
)
def test_invalid_settings_are_errors(text, message, hint):
    with pytest.raises(ConfigError) as caught:
        settings(text)
    assert message in caught.value.message
    assert hint is None or hint in (caught.value.hint or "")
    if "virtual" not in text and "zmq" not in text:
        assert (caught.value.file, caught.value.line) == ("/there/cxbridge.yaml", 2)


# -- in this process


def test_daemon_serves_blackboard_and_status(tmp_path):
    before = set(threading.enumerate())
    endpoint = f"ipc://{tmp_path}/bb"
    with running(settings=(("zmq/endpoints", [endpoint]), *ANY_PORT)) as (daemon, _, outcome):
        assert daemon.endpoints[0] == endpoint
        with connected(daemon) as board:
            status = read_status(board)
            assert [(part["name"], part["state"], part["reason"]) for part in status["components"]] == [
                (name, "ACTIVE", "") for name in ("blackboard", "zmq", *TRANSPORT, "speech", "skiller")
            ]
            assert (status["state"], status["pid"]) == ("RUNNING", os.getpid())
            assert status["endpoints"] == " ".join(daemon.endpoints)
        for url in daemon.endpoints[1:]:  # Fawkes' protocol
            with open_blackboard(url, InterfaceRegistry(), RealClock()) as board:
                assert read_status(board)["state"] == "RUNNING"
    assert outcome == [0]
    assert not set(threading.enumerate()) - before
    assert not daemon.board.list_all()


def test_pause_resume_reset_and_shutdown_by_messages(tmp_path):
    with running(settings=(*QUIET[:1], ("zmq/endpoints", [f"ipc://{tmp_path}/bb"]))) as (daemon, _, outcome):
        with connected(daemon) as board:
            assert send_command(board, "Pause", WAIT_S)
            states = {part["name"]: part["state"] for part in read_status(board)["components"]}
            assert states == {
                "blackboard": "ACTIVE",
                "zmq": "ACTIVE",
                "speech": "INACTIVE",
                "skiller": "INACTIVE",
            }
            status = read_status(board)
            assert (status["state"], status["error"]) == ("PAUSED", "")
            assert send_command(board, "Resume", WAIT_S)
            assert read_status(board)["state"] == "RUNNING"
            reader = board.open_for_reading(SkillerInterface, "Skiller", owner="test")
            assert send_command(board, "Reset", WAIT_S)
            assert reader.has_writer
            assert read_status(board)["state"] == "RUNNING"
            assert send_command(board, "Shutdown", WAIT_S)
            until(lambda: outcome)
        assert outcome == [0]


def test_commands_need_remote_control(tmp_path):
    options: Any = (*QUIET[:1], ("zmq/endpoints", [f"ipc://{tmp_path}/bb"]), ("remote-control", False))
    with running(settings=options) as (daemon, _lines, _), connected(daemon) as board:
        for what in ("Pause", "Resume", "Reset", "Shutdown"):
            with pytest.raises(RemoteRefusalError, match="remote-control of the daemon is off"):
                send_command(board, what, WAIT_S)
        assert read_status(board)["state"] == "RUNNING"


def test_blackboard_without_daemon_is_an_error():
    with (
        open_blackboard("local:", InterfaceRegistry(), RealClock()) as board,
        pytest.raises(BlackBoardError, match="has no daemon"),
    ):
        read_status(board)


@pytest.mark.parametrize(
    ("policy", "state", "status"), [("stop", "STOPPING", [4]), ("continue", "DEGRADED", [])]
)
def test_failed_component_follows_failure_policy(policy, state, status):
    with running(settings=(*QUIET, ("on-failure", policy))) as (daemon, lines, outcome):
        broken = next(node for node in daemon.lifecycle.nodes if node.name == "speech")
        broken.check = lambda: 1 // 0
        assert until(lambda: outcome == status and daemon.state == state)
        assert any("speech failed: ZeroDivisionError" in line for line in lines)


def test_second_daemon_does_not_take_over_ipc_endpoint(tmp_path):
    """ZeroMQ would unlink the socket of the first server, and bind."""
    options: Any = (*QUIET[:1], ("zmq/endpoints", [f"ipc://{tmp_path}/bb"]), ("skiller", "none"))
    with running(settings=options) as (first, _, _o):
        with running(settings=options) as (_, _lines, outcome):
            assert isinstance(outcome[0], CxbridgeError)
            assert "another process serves ipc://" in outcome[0].message
        with connected(first) as board:
            assert read_status(board)["state"] == "RUNNING"
    with running(settings=options) as (third, _, _o), connected(third) as board:
        assert read_status(board)["state"] == "RUNNING"


def test_commands_run_in_main_loop():
    """A reset on a client's thread used CLIPS beside the main loop: now and then the process crashed."""
    with running(settings=QUIET) as (daemon, _, outcome):
        with pytest.raises(RuntimeError, match="carried out by its main loop"):
            daemon.carry_out("reset")
        assert send_command(daemon.board, "Reset", WAIT_S)
    assert outcome == [0]


def test_executive_runs_agent(tmp_path):
    scenario = write_scenario(tmp_path / "s")
    trace = tmp_path / "t.mcap"
    with running(config=scenario, settings=(*QUIET, ("record/trace", str(trace)))) as (daemon, _, outcome):
        assert until(lambda: daemon.node.executive and daemon.node.executive.goals.outcome_counts)
        executive = daemon.node.executive
        assert [state.outcome for state in executive.goals.ended_roots] == ["COMPLETED"]
    assert outcome == [0]
    loaded = [source.name for source in run_sources(open_run(trace), "clips", owner="executive")]
    assert {Path(name).name for name in loaded} >= {"utils.clp", "init.clp", "mini.clp"}
    assert {source.name for source in run_sources(open_run(trace), "config")} == {
        str(scenario / "scenario.yaml")
    }


def test_restarted_daemon_keeps_earlier_recordings(tmp_path):
    """A restart by systemd overwrote the recording of the crashed daemon."""
    named = {"record/trace": tmp_path / "run.mcap", "record/log": tmp_path / "run.log"}
    for _ in range(2):
        with running(
            settings=(*QUIET, ("skiller", "none"), *((at, str(file)) for at, file in named.items()))
        ):
            pass
    for file in named.values():
        runs = [open_run(path) for path in tmp_path.glob(f"run*{file.suffix}")]
        assert len(runs) == 2
        assert all(list(run) for run in runs)


# -- as a process


def start(tmp_path, *arguments, env=None, until="Daemon: Ready", ignore=None):
    """Start a daemon, and wait for a line of its log; its parent ignores the signal ``ignore``."""
    endpoint = f"ipc://{tmp_path}/bb"
    command = ("daemon", *arguments, "--endpoint", endpoint, *(("--fawkes-port", "0") if HAS_FAWKES else ()))
    process = Started(*command, environment=env, ignore=ignore)
    for line in process.stderr:
        if until in line:
            break
    return process, endpoint


@pytest.mark.parametrize(
    ("number", "ignored"),
    [
        *((signal.SIGINT, None), (signal.SIGTERM, None)),
        (
            signal.SIGINT,
            signal.SIGINT,
        ),  # by a shell without job control that starts the daemon in the background
    ],
)
def test_signals_stop_daemon_cleanly(tmp_path, number, ignored):
    process, endpoint = start(tmp_path, ignore=ignored)
    process.send_signal(number)
    output, errors = process.communicate(timeout=WAIT_S)
    assert process.returncode == 0, errors
    assert output == ""
    assert "Daemon: Stopped" in errors
    assert "Traceback" not in errors
    assert not Path(endpoint.removeprefix("ipc://")).exists()


# -- documentation


@needs_all_plugins
def test_page_shows_every_setting():
    import re

    from cxbridge.daemon.settings import KEYS
    from cxbridge.run.plugin_settings import list_plugin_keys

    page = (ROOT / "docs" / "daemon.md").read_text()
    (sample,) = re.findall(r"^```yaml\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    config = Configuration.from_text(sample, "docs/daemon.md")
    assert "fawkes" in DaemonSettings.from_config(config).sections
    shown = {value.path.removeprefix("/cxbridge/") for value in config.search("/cxbridge")}
    assert shown == {*KEYS, *list_plugin_keys()}


def until(condition: Callable[[], object]) -> bool:
    """Wait until a condition holds that a loop of the daemon brings about."""
    pause = threading.Event()
    for _ in range(WAIT_S * 50):
        if condition():
            return True
        pause.wait(0.02)
    return False
