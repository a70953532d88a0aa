"""The debug adapter in a process, and a recording to look into."""

from __future__ import annotations

import pytest

from cxbridge.resources import shipped_dir
from studio_tests.dap.client import Client
from tests.forked import nursery
from tests.support import ROOT

SCENARIO = shipped_dir("scenarios") / "test-scenario"
GOALS = SCENARIO / "talk-goals.clp"
LEAVES = SCENARIO / "talk-leaves.clp"


@pytest.fixture
def client():
    with Client(ROOT) as made:
        yield made


@pytest.fixture(scope="session")
def recording(tmp_path_factory):
    file = tmp_path_factory.mktemp("dap") / "run.mcap"
    command = ["run", "-q", str(SCENARIO), "--trace", str(file), "--trace-level", "facts"]
    nursery().run(command).check_returncode()
    return file


def line_of(file, text):
    """The number of the first line with a text."""
    return 1 + next(n for n, line in enumerate(file.read_text().splitlines()) if text in line)
