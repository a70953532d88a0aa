"""The daemon in this process and as one of its own; its settings, its state, its commands."""

from __future__ import annotations

import os
import signal
import socket
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
from cxbridge.events import InterfaceWrite
from cxbridge.interfaces import InterfaceRegistry, SkillerInterface, SwitchInterface
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.sources import run_sources
from tests.fawkes import ANY_PORT, HAS_FAWKES, TRANSPORT
from tests.programs import Started
from tests.run.mini import write_scenario
from tests.support import ROOT, needs_all_plugins, needs_plugin

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


def test_without_a_configuration_there_are_defaults():
    made = settings("a: 1\n")
    assert (made.clock, made.executive, made.skiller, made.endpoints) == (
        "real",
        False,
        "lua",
        ("tcp://127.0.0.1:1911",),
    )
    if HAS_FAWKES:
        fawkes: Any = made.sections["fawkes"]
        assert (fawkes.host, fawkes.port, fawkes.allow) == ("127.0.0.1", 1910, ())


def test_files_are_seen_from_the_configuration():
    made = settings("cxbridge: {zmq: {secret-key: a.key, clients: /keys}, record: {trace: t.mcap}}\n")
    assert (made.secret_key, made.clients, made.trace) == (
        Path("/there/a.key"),
        Path("/keys"),
        Path("/there/t.mcap"),
    )


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
        ("cxbridge:\n  zmq: {clients: keys}\n", "CURVE needs both keys", "make keys"),
    ],
)
def test_settings_that_make_no_sense(text, message, hint):
    with pytest.raises(ConfigError) as caught:
        settings(text)
    assert message in caught.value.message
    assert hint is None or hint in (caught.value.hint or "")
    if "virtual" not in text and "zmq" not in text:
        assert (caught.value.file, caught.value.line) == ("/there/cxbridge.yaml", 2)


# -- in this process


def test_it_serves_its_blackboard_and_tells_how_it_stands(tmp_path):
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
            assert read_status(board)["state"] == "PAUSED"
            assert send_command(board, "Resume", WAIT_S)
            assert read_status(board)["state"] == "RUNNING"
            reader = board.open_for_reading(SkillerInterface, "Skiller", owner="test")
            assert send_command(board, "Reset", WAIT_S)
            assert reader.has_writer
            assert read_status(board)["state"] == "RUNNING"
            assert send_command(board, "Shutdown", WAIT_S)
            daemon_gone = threading.Event()
            for _ in range(WAIT_S * 50):
                if outcome:
                    break
                daemon_gone.wait(0.02)
        assert outcome == [0]


def test_commands_are_refused_when_remote_control_is_off(tmp_path):
    options: Any = (*QUIET[:1], ("zmq/endpoints", [f"ipc://{tmp_path}/bb"]), ("remote-control", False))
    with running(settings=options) as (daemon, _lines, _), connected(daemon) as board:
        for what in ("Pause", "Resume", "Reset", "Shutdown"):
            with pytest.raises(RemoteRefusalError, match="remote-control of the daemon is off"):
                send_command(board, what, WAIT_S)
        assert read_status(board)["state"] == "RUNNING"


@needs_plugin("fawkes")
def test_what_bblogger_writes_is_switched_as_fawkes_does_it_and_the_trace_goes_on(tmp_path):
    options: Any = (
        ("zmq/endpoints", []),
        ("fawkes/port", 0),
        ("skiller", "none"),
        ("record/bblog", str(tmp_path / "logs")),
        ("record/trace", str(tmp_path / "run.mcap")),
    )
    disable, enable = (SwitchInterface.MESSAGES[f"{name}SwitchMessage"] for name in ("Disable", "Enable"))
    with running(settings=options) as (daemon, _, _o):
        writer = daemon.board.open_for_writing(SwitchInterface, "s")
        with connected(daemon) as board:
            switch = board.open_for_reading(SwitchInterface, "BBLogger")
            switch.read()  # what was there before is not an answer
            for number, message in enumerate((disable, enable, None), 1):
                writer.value = number
                writer.write()
                if message is not None:
                    switch.msgq_enqueue(message())
                    for _ in range(WAIT_S * 50):
                        switch.read()
                        if switch.enabled is (message is enable):
                            break
                        threading.Event().wait(0.02)
                    assert switch.enabled is (message is enable)
    recorded = [
        [
            event.values["value"]
            for event in open_run(tmp_path / name)
            if isinstance(event, InterfaceWrite) and event.uid == "SwitchInterface::s"
        ]
        for name in ("logs", "run.mcap")
    ]
    assert recorded == [[1, 3], [1, 2, 3]]


@needs_plugin("fawkes")
def test_there_is_no_switch_when_remote_control_is_off(tmp_path):
    options: Any = (*QUIET, ("remote-control", False), ("record/bblog", str(tmp_path / "logs")))
    with running(settings=options) as (daemon, _, _o):
        assert not daemon.board.list("SwitchInterface", "BBLogger")


def test_another_blackboard_has_no_daemon():
    with (
        open_blackboard("local:", InterfaceRegistry(), RealClock()) as board,
        pytest.raises(BlackBoardError, match="has no daemon"),
    ):
        read_status(board)


def test_a_component_that_fails_ends_the_daemon_with_status_4():
    with running(settings=QUIET) as (daemon, lines, outcome):
        broken = next(node for node in daemon.lifecycle.nodes if node.name == "speech")
        broken.check = lambda: 1 // 0
        done = threading.Event()
        for _ in range(WAIT_S * 50):
            if outcome:
                break
            done.wait(0.02)
        assert outcome == [4]
        assert any("speech failed: ZeroDivisionError" in line for line in lines)


def test_a_component_that_fails_leaves_the_others_alone_when_told_so():
    with running(settings=(*QUIET, ("on-failure", "continue"))) as (daemon, _, outcome):
        broken = next(node for node in daemon.lifecycle.nodes if node.name == "speech")
        broken.check = lambda: 1 // 0
        done = threading.Event()
        for _ in range(WAIT_S * 50):
            if daemon.presence._daemon_interface.state.name == "DEGRADED":
                break
            done.wait(0.02)
        assert daemon.presence._daemon_interface.error.startswith("speech: ZeroDivisionError")
        assert outcome == []


@needs_plugin("fawkes")
def test_a_second_daemon_at_the_same_place_is_told_why_not(tmp_path):
    with running(settings=(("zmq/endpoints", []), ("fawkes/port", 0), ("skiller", "none"))) as (first, _, _o):
        port = int(first.endpoints[0].rpartition(":")[2])
        options: Any = (("zmq/endpoints", []), ("fawkes/port", port), ("skiller", "none"))
        with running(settings=options) as (_, _lines, outcome):
            assert isinstance(outcome[0], CxbridgeError)
            assert f"cannot listen on 127.0.0.1:{port}" in outcome[0].message
            assert outcome[0].exit_status == 2


def test_a_second_daemon_at_the_same_ipc_endpoint_does_not_take_it_over(tmp_path):
    """ZeroMQ unlinks the socket of the server there, and binds."""
    options: Any = (*QUIET[:1], ("zmq/endpoints", [f"ipc://{tmp_path}/bb"]), ("skiller", "none"))
    with running(settings=options) as (first, _, _o):
        with running(settings=options) as (_, _lines, outcome):
            assert isinstance(outcome[0], CxbridgeError)
            assert "another process serves ipc://" in outcome[0].message
        with connected(first) as board:
            assert read_status(board)["state"] == "RUNNING"
    with running(settings=options) as (third, _, _o), connected(third) as board:
        assert read_status(board)["state"] == "RUNNING"


@pytest.mark.parametrize(
    "changes",
    [
        (("zmq/endpoints", ["tcp://0.0.0.0:*"]), ("fawkes/enable", False)),
        pytest.param(
            (("zmq/endpoints", []), ("fawkes/host", "0.0.0.0"), ("fawkes/port", 0)),
            marks=needs_plugin("fawkes"),
        ),
    ],
)
def test_beyond_loopback_it_needs_keys_or_an_allow_list(changes):
    with running(settings=(*changes, ("skiller", "none"))) as (_, _lines, outcome):
        assert isinstance(outcome[0], CxbridgeError)


def test_commands_are_for_the_main_loop():
    """A reset on a client's thread used CLIPS beside the main loop: now and then the process crashed."""
    with running(settings=QUIET) as (daemon, _, outcome):
        with pytest.raises(RuntimeError, match="carried out by its main loop"):
            daemon.carry_out("reset")
        assert send_command(daemon.board, "Reset", WAIT_S)
    assert outcome == [0]


def test_the_executive_runs_its_agent(tmp_path):
    scenario = write_scenario(tmp_path / "s")
    trace = tmp_path / "t.mcap"
    with running(config=scenario, settings=(*QUIET, ("record/trace", str(trace)))) as (daemon, _, outcome):
        done = threading.Event()
        assert daemon.node is not None
        for _ in range(WAIT_S * 50):
            executive = daemon.node.executive
            if executive is not None and executive.goals.outcome_counts:
                break
            done.wait(0.02)
        assert executive is not None
        assert [state.outcome for state in executive.goals.ended_roots] == ["COMPLETED"]
    assert outcome == [0]
    loaded = [source.name for source in run_sources(open_run(trace), "clips", owner="executive")]
    assert {Path(name).name for name in loaded} >= {"utils.clp", "init.clp", "mini.clp"}
    assert {source.name for source in run_sources(open_run(trace), "config")} == {
        str(scenario / "scenario.yaml")
    }


def test_a_daemon_that_starts_again_keeps_what_it_recorded_before(tmp_path):
    """The recording of a daemon that crashed was gone when systemd had started it again."""
    named = {"record/trace": tmp_path / "run.mcap", "record/log": tmp_path / "run.log"}
    for _ in range(2):
        with running(
            settings=(*QUIET, ("skiller", "none"), *((at, str(file)) for at, file in named.items()))
        ):
            pass
    for file in named.values():
        runs = [open_run(each) for each in tmp_path.glob(f"run*{file.suffix}")]
        assert len(runs) == 2
        assert all(list(run) for run in runs)


@needs_plugin("fawkes")
def test_a_skiller_elsewhere_is_mirrored_when_it_comes(tmp_path):
    endpoint = f"ipc://{tmp_path}/bb"
    with running(settings=(("zmq/endpoints", [endpoint]), ("fawkes/enable", False), ("skiller", "none"))) as (
        first,
        _,
        _o,
    ):
        options: Any = (*QUIET, ("skiller", endpoint))
        with running(settings=options) as (second, _, _o2):
            reader = second.board.open_for_reading(SkillerInterface, "Skiller", owner="test")
            assert not reader.has_writer
            first.board.open_for_writing(SkillerInterface, "Skiller", owner="skiller")
            done = threading.Event()
            for _ in range(WAIT_S * 50):
                if reader.has_writer:
                    break
                done.wait(0.02)
            assert reader.has_writer


# -- as a process


def start(tmp_path, *arguments, env=None, until="Daemon: Ready", ignore=None):
    """Start a daemon, and wait for a line of its log; ``ignore``: a signal that its parent ignores."""
    endpoint = f"ipc://{tmp_path}/bb"
    command = ("daemon", *arguments, "--endpoint", endpoint, *(("--fawkes-port", "0") if HAS_FAWKES else ()))
    process = Started(*command, environment=env, ignore=ignore)
    for line in process.stderr:
        if until in line:
            break
    return process, endpoint


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_stop_it_cleanly(tmp_path, number):
    process, _ = start(tmp_path)
    process.send_signal(number)
    output, errors = process.communicate(timeout=WAIT_S)
    assert process.returncode == 0, errors
    assert output == ""
    assert "Daemon: Stopped" in errors
    assert "Traceback" not in errors


def test_systemd_is_told(tmp_path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(str(tmp_path / "notify"))
        listener.settimeout(WAIT_S)
        env = {**os.environ, "NOTIFY_SOCKET": str(tmp_path / "notify")}
        process, endpoint = start(tmp_path, "--skiller", "none", env=env)
        first = listener.recv(4096).decode()
        assert first.startswith(f"READY=1\nSTATUS=serving at {endpoint}")
        process.terminate()
        process.communicate(timeout=WAIT_S)
        rest: list[str] = []
        while not rest or rest[-1] != "STOPPING=1":
            rest.append(listener.recv(4096).decode())
        assert set(rest) <= {"WATCHDOG=1", "STOPPING=1"}


# -- documentation


@needs_all_plugins
def test_the_configuration_of_the_page_is_one_and_shows_every_setting():
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
