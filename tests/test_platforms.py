"""Commands need only the modules of the platform that they use.

`make platforms` checks the whole package against the standard library of Windows and of macOS; the tests here
run commands without the modules and names that Windows lacks.
"""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from cxbridge.blackboard.kit.errors import EndpointError
from cxbridge.blackboard.zmq.wire.sockets import make_context
from tests.support import ROOT, needs_plugin, share

WITHOUT = """
import os, select, shutil, signal, subprocess, sys, tempfile
for module in ("fcntl", "grp", "pwd", "resource", "termios", "tty"):
    sys.modules[module] = None
for module, names in {
    os: ("O_NONBLOCK", "fork", "geteuid", "getuid", "killpg", "set_blocking"),
    select: ("epoll", "poll"),
    signal: ("SIGHUP", "SIGUSR1"),  # SIGKILL is needed by subprocess here
}.items():
    for name in names:
        if hasattr(module, name):
            delattr(module, name)
shutil._use_fd_functions = False  # as there; Python 3.13 opens folders with O_NONBLOCK otherwise
"""

STRICT = ("-X", "warn_default_encoding", "-W", "error::EncodingWarning")
"""The default encoding of Windows differs: each open text file must name its encoding."""

RUN = """
from cxbridge.cli.main import main
main(sys.argv[1:])
"""

DAEMON = """
import json, threading, urllib.request
from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.options import DaemonOptions
from cxbridge.daemon.client import read_status
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.clock import RealClock
from cxbridge.interfaces import InterfaceRegistry

settings = (("zmq/endpoints", []), ("fawkes/port", 0), ("web/port", 0))
daemon = Daemon(DaemonOptions(settings=settings), lambda line: line.text == "Ready" and looking.start())

def look():
    try:
        fawkes, web = daemon.endpoints
        with open_blackboard(fawkes, InterfaceRegistry(), RealClock()) as board:
            print(read_status(board)["state"])
        with urllib.request.urlopen(web + "/api/cxbridge/status", timeout=20) as reply:
            print(json.load(reply)["state"])
    finally:
        daemon.stop()

looking = threading.Thread(target=look)
print(daemon.run())
looking.join()
"""


@pytest.mark.parametrize(
    "command",
    share(
        [
            ("run", "-q", "scenarios/test-scenario"),
            ("doctor",),
            ("interface", "show", "SkillerInterface"),
            ("daemon", "--help"),
        ],
        2,
    ),
    ids=" ".join,
)
def test_command_works_without_modules_missing_on_windows(command):
    check_command(command)


@needs_plugin("planning")
def test_planner_works_without_modules_missing_on_windows():
    check_command(("run", "-q", "scenarios/test-scenario-pddl"))  # a planner is a process


def check_command(command):
    """Run a command without the modules that Windows lacks."""
    done = subprocess.run(
        [sys.executable, *STRICT, "-c", WITHOUT + RUN, *command],
        cwd=ROOT,
        # the encoding of pipes on Windows; it lacks the box-drawing characters of trees
        env=os.environ | {"PYTHONIOENCODING": "cp1252:strict"},
        encoding="cp1252",
        capture_output=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout
    assert "Traceback" not in done.stderr


@needs_plugin("web")
def test_daemon_works_without_modules_missing_on_windows():
    done = subprocess.run(
        [sys.executable, *STRICT, "-c", WITHOUT + DAEMON],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert (done.returncode, done.stdout.split()) == (0, ["RUNNING", "RUNNING", "0"]), done.stderr


def test_zmq_endpoint_on_windows_is_an_error(monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(sys, "platform", "win32")
        with pytest.raises(EndpointError, match="Windows"):
            make_context()
