"""The temporary files of engines, which are removed after each kind of end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from cxbridge_planning.service.jobs import FOLDER_PREFIX
from cxbridge_planning.service.process import PlannerProcess
from tests.support import ROOT

WAIT_S = 30
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="has no signals")


@pytest.fixture
def base(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def find_folders(base):
    return [path for path in base.iterdir() if path.name.startswith(FOLDER_PREFIX)]


def becomes_false(condition):
    deadline_s = time.monotonic() + WAIT_S
    while condition():
        if time.monotonic() > deadline_s:
            return False
        time.sleep(0.05)
    return True


def test_close_removes_files_of_killed_engine(base):
    process = PlannerProcess()
    (folder,) = find_folders(base)
    (folder / "aries-1234").mkdir()
    os.kill(process._process.pid, signal.SIGKILL)
    process.close()
    assert find_folders(base) == []


OWNER = """
import sys, time
from cxbridge_planning.service.process import PlannerProcess
process = PlannerProcess()
print(process._process.pid, flush=True)
time.sleep(600)
"""


def test_kill_of_owner_ends_planners_and_removes_files(tmp_path, monkeypatch):
    owner = subprocess.Popen(
        [sys.executable, "-c", OWNER],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"TMPDIR": str(tmp_path)},
    )
    assert owner.stdout is not None
    worker = int(owner.stdout.readline())
    owner.kill()
    owner.communicate()
    assert becomes_false(
        lambda: Path(f"/proc/{worker}/cmdline").exists() and Path(f"/proc/{worker}/cmdline").read_bytes()
    )
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    assert becomes_false(lambda: find_folders(tmp_path))
