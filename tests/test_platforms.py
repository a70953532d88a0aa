"""What other systems lack is missed only by those who need it.

`make platforms` checks the whole package against the standard library of Windows and of macOS; here it runs
with the modules and names taken away that Windows lacks.
"""

from __future__ import annotations

import subprocess
import sys

import pytest

from cxbridge.app.stepping import StepKeys
from cxbridge.blackboard.zmq.errors import EndpointError
from cxbridge.blackboard.zmq.wakeup import Wakeup
from cxbridge.errors import CxbridgeError
from tests.support import ROOT

WITHOUT = """
import os, select, signal, subprocess, sys, tempfile
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
from cxbridge.cli.main import main
main(sys.argv[1:])
"""


@pytest.mark.parametrize(
    "command",
    [
        ("run", "-q", "scenarios/test-scenario"),
        ("run", "-q", "scenarios/test-scenario-pddl"),  # a planner is a process
        ("doctor",),
        ("interface", "show", "SkillerInterface"),
        ("daemon", "--help"),
    ],
    ids=" ".join,
)
def test_it_works_without_what_windows_lacks(command):
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT, *command],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr


def test_windows_is_told_that_zmq_is_not_there(monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(sys, "platform", "win32")
        with pytest.raises(EndpointError, match="Windows"):
            Wakeup()


def test_windows_is_told_that_keys_are_not_there(monkeypatch, tmp_path):
    (tmp_path / "keys").touch()
    with (tmp_path / "keys").open() as stream:
        keys = StepKeys(stream)
        with monkeypatch.context() as patch:
            patch.setattr(sys, "platform", "win32")
            with pytest.raises(CxbridgeError, match="Windows"):
                keys.__enter__()
