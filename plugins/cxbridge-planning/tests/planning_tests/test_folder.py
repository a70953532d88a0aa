"""Engines leave no temporary files behind, however they are ended."""

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


def folders(base):
    return [path for path in base.iterdir() if path.name.startswith(FOLDER_PREFIX)]


def gone(look):
    deadline_s = time.monotonic() + WAIT_S
    while look():
        if time.monotonic() > deadline_s:
            return False
        time.sleep(0.05)
    return True


def test_what_an_engine_leaves_goes_with_its_process(base):
    process = PlannerProcess()
    (folder,) = folders(base)
    (folder / "aries-1234").mkdir()
    os.kill(process._process.pid, signal.SIGKILL)
    process.close()
    assert folders(base) == []


OWNER = """
import sys, time
from cxbridge_planning.service.process import PlannerProcess
process = PlannerProcess()
print(process._process.pid, flush=True)
time.sleep(600)
"""


def test_when_the_owner_is_killed_its_planners_end_and_their_files_go(tmp_path, monkeypatch):
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
    assert gone(
        lambda: Path(f"/proc/{worker}/cmdline").exists() and Path(f"/proc/{worker}/cmdline").read_bytes()
    )
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    assert gone(lambda: folders(tmp_path))
