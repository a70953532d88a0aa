"""The debug adapter in a process, and a recording to look into."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.dap.client import Client
from tests.support import ROOT

SCENARIO = ROOT / "scenarios" / "test-scenario"
GOALS = SCENARIO / "talk-goals.clp"
LEAVES = SCENARIO / "talk-leaves.clp"


@pytest.fixture
def client():
    with Client(ROOT) as made:
        yield made


@pytest.fixture(scope="session")
def recording(tmp_path_factory):
    file = tmp_path_factory.mktemp("dap") / "run.mcap"
    command = [sys.executable, "-m", "cxbridge", "run", "-q", str(SCENARIO), "--trace", str(file)]
    subprocess.run([*command, "--trace-level", "facts"], check=True, capture_output=True)
    return file


def line_of(file, text):
    """The number of the first line with a text."""
    return 1 + next(n for n, line in enumerate(file.read_text().splitlines()) if text in line)
