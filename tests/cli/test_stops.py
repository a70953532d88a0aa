"""Signals at any instant: statuses and remains of programs."""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

from cxbridge.interrupt import Interrupt
from tests.cli import stops
from tests.daemon.test_daemon import WAIT_S, start
from tests.fawkes import NO_SERVER
from tests.programs import Started
from tests.run.mini import write_scenario
from tests.support import SEED, many, needs_plugin, share


@pytest.fixture(scope="module")
def boards():
    """The URLs of two daemons to connect to."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))  # a short name, for sockets
        urls = [f"ipc://{folder}/{name}" for name in ("left", "right")]
        for url, skiller in zip(urls, ("simulator", "none"), strict=True):
            log = folder / f"{skiller}.log"
            with log.open("w") as errors:  # no pipe, which would have no reader
                more = ("--endpoint", url, *NO_SERVER, "--skiller", skiller)
                process = stack.enter_context(Started("daemon", *more, stderr=errors))
            while "Daemon: Ready" not in log.read_text():
                assert process.poll() is None, log.read_text()
                time.sleep(0.02)
        yield urls


# the plug-ins of the programs that the core does not have, or that write a plug-in's files
PLUGINS = {"monitor": "studio", "gateway": "fawkes", "record": "fawkes"}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=needs_plugin(PLUGINS[name])) if name in PLUGINS else name
        for name in share(stops.PROGRAMS, 3)
    ],
)
def test_stops_at_random_instants(name, boards):
    faults = stops.run(stops.PROGRAMS[name], boards, many(10, 1), SEED)
    assert not faults, "\n".join(faults)


def test_signal_during_sleep_of_background_daemon_is_no_fault(tmp_path):
    """A shell without job control starts a background process with SIGINT ignored."""
    more = "\nfawkes/mainapp/desired_loop_time: 1100000\n"
    scenario = write_scenario(tmp_path / "s", agent="(deffacts nothing)", more=more)
    process, _ = start(tmp_path, str(scenario), ignore=signal.SIGINT)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=WAIT_S)
    assert process.returncode == 0, errors
    assert "the agent has quit" not in errors


def test_signal_during_start_of_executive_is_no_fault(tmp_path):
    """Endless rules are interrupted; the resulting error is not a failure of the start."""
    agent = "(defrule spin => (printout error LOADING crlf) (while TRUE (bind ?x 1)))"
    process, _ = start(tmp_path, str(write_scenario(tmp_path / "s", agent=agent)), until="LOADING")
    process.terminate()
    _, errors = process.communicate(timeout=WAIT_S)
    assert process.returncode == 0, errors
    assert "Daemon: Stopped" in errors


@pytest.mark.skipif(sys.platform == "win32", reason="has no SIGHUP")
def test_daemon_below_nohup_survives_hangup(tmp_path):
    process, _ = start(tmp_path, ignore=signal.SIGHUP)
    process.send_signal(signal.SIGHUP)
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(timeout=1)
    process.terminate()
    _, errors = process.communicate(timeout=WAIT_S)
    assert process.returncode == 0, errors


# -- the parts


def test_nested_interrupt_shares_signals_with_outer_interrupt():
    stopped = threading.Event()
    with Interrupt() as outer:
        signal.raise_signal(signal.SIGTERM)
        assert outer.is_signalled
        with Interrupt(stopped.set) as inner:
            assert inner.is_signalled
            assert stopped.wait(WAIT_S)
    with Interrupt() as outer:
        with Interrupt():
            signal.raise_signal(signal.SIGTERM)
        assert outer.is_signalled


def test_interrupt_forces_end_after_grace_period():
    asked, forced = threading.Event(), threading.Event()
    with Interrupt(asked.set, forced.set) as interrupt:
        interrupt.give_time(3600)
        signal.raise_signal(signal.SIGTERM)
        assert asked.wait(WAIT_S)
        assert not forced.is_set()
        interrupt.give_time(0)
        assert forced.wait(WAIT_S)


def test_signal_handler_takes_no_lock_of_interrupted_code():
    """``Event.set`` in a handler waits for ever when the main thread is in ``Event.wait``."""
    event = threading.Event()
    names = []

    def stop():
        names.append(threading.current_thread().name)
        event.set()

    with Interrupt(stop):
        signal.raise_signal(signal.SIGTERM)
        assert event.wait(WAIT_S)
    assert set(names) == {"interrupt"}
