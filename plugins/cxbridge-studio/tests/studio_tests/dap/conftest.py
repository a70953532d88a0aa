"""A client with a debug adapter in a child process."""

from __future__ import annotations

import pytest

from cxbridge.resources import shipped_dir
from studio_tests.dap.client import Client
from tests.support import ROOT

SCENARIO = shipped_dir("scenarios") / "test-scenario"
GOALS = SCENARIO / "talk-goals.clp"
LEAVES = SCENARIO / "talk-leaves.clp"


@pytest.fixture
def client():
    with Client(ROOT) as client:
        yield client


def find_line(file, text):
    """Return the number of the first line with a text."""
    return 1 + next(n for n, line in enumerate(file.read_text().splitlines()) if text in line)
