"""Runs under attack: signals while nothing returns, outputs that cannot be, options out of range."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cxbridge.cli.main import invoke
from tests.programs import Started
from tests.run.mini import AGENT, write_scenario
from tests.support import ROOT

SPIN = "(defrule spin (executive-initialized) => (printout error SPINS crlf) (while TRUE (bind ?x 1)))"


def start(*arguments, wait_for):
    """Start a run, and return its process after a text in the log."""
    process = Started("run", "-v", *arguments)
    for line in process.stderr:
        if wait_for in line:
            return process
    raise AssertionError(f"the run ended with {process.wait()}")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signal_ends_endless_right_hand_side(tmp_path, number):
    process = start(write_scenario(tmp_path, agent=SPIN), wait_for="SPINS")
    process.send_signal(number)
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 130
    assert "Traceback" not in errors


STUCK = """
import ctypes, sys
from cxbridge.interrupt import Interrupt

lock, mutex = ctypes.CDLL(None).pthread_mutex_lock, ctypes.create_string_buffer(64)
lock(mutex)
with Interrupt(lambda: None):
    print("STUCK", file=sys.stderr, flush=True)
    lock(mutex)
"""
"""A program in a function of C without checks for signals; skills cannot get there any more."""


def test_third_signal_ends_blocked_process():
    command = [sys.executable, "-c", STUCK]
    process = subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    assert process.stderr.readline() == "STUCK\n"
    deadline = time.monotonic() + 60
    while process.poll() is None and time.monotonic() < deadline:
        process.send_signal(signal.SIGINT)
        time.sleep(0.2)
    process.kill()
    _, errors = process.communicate()
    assert process.returncode == 130
    assert "the third signal ends it at once" in errors


def test_recording_of_killed_run_is_readable(tmp_path, capsys):
    scenario = write_scenario(tmp_path / "s", mapping="act: wait{seconds=1000}")
    trace = tmp_path / "t.mcap"
    process = start(scenario, "--clock", "real", "--trace", trace, wait_for="Calling skill")
    deadline = time.monotonic() + 20
    while time.monotonic() < deadline:
        invoke(["trace", "transitions", str(trace)])
        if "RUNNING" in capsys.readouterr().out:
            break
        time.sleep(0.1)
    else:
        pytest.fail("nothing came into the file while the run waited")
    process.kill()
    process.communicate()
    assert invoke(["trace", "transitions", str(trace)]) == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--timeout", "inf"], "--timeout cannot be inf"),
        (["--clock", "scaled:inf"], "cannot run at inf times"),
        (["--clock", "scaled:1e-300"], "cannot run at 1e-300 times"),
        (["--clock", "scaled:1e300"], "cannot run at 1e+300 times"),
        (["--trace", "{here}/x", "--log", "{here}/./x"], "the same file"),
        (["--log", "{here}/mini.clp"], "would overwrite this file"),
        (["--trace", "{here}/" + "x" * 300], "File name too long"),
    ],
)
def test_impossible_options_are_one_message_and_status_2(tmp_path, capsys, arguments, message):
    scenario = write_scenario(tmp_path)
    assert invoke(["run", str(scenario), *(text.format(here=tmp_path) for text in arguments)]) == 2
    captured = capsys.readouterr()
    assert message in captured.err
    assert captured.out == ""
    assert (tmp_path / "mini.clp").read_text() == AGENT


@pytest.mark.parametrize("period", [0, 1])
def test_invalid_loop_time_is_refused(tmp_path, capsys, period):
    file = write_scenario(tmp_path) / "scenario.yaml"
    text = file.read_text()
    file.write_text(text + f"fawkes/mainapp:\n  desired_loop_time: {period}\n")
    assert invoke(["run", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert f"{file}:{text.count(chr(10)) + 2}" in error
    assert f"desired_loop_time cannot be {period}" in error


def test_pipe_in_place_of_agents_file_is_an_error(tmp_path, capsys):
    scenario = write_scenario(tmp_path)
    (scenario / "mini.clp").unlink()
    os.mkfifo(scenario / "mini.clp")
    assert invoke(["run", str(scenario)]) == 2
    assert "mini.clp is not a regular file" in capsys.readouterr().err


def test_full_stdout_is_one_message():
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        process = Started("interface", "list", stdout=full)
    _, errors = process.communicate()
    assert process.returncode == 2
    assert errors == "cxbridge: error: cannot write to stdout: No space left on device\n"
