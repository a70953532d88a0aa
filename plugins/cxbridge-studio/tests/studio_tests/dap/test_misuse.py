"""Invalid requests, one after the other: each has an answer that says so, and the run continues."""

from __future__ import annotations

import pytest

from studio_tests.dap.conftest import GOALS, line_of
from tests.support import ROOT, share

GOES_ON = line_of(GOALS, "(defrule talk-root-goes-on")


@pytest.mark.parametrize(
    "name",
    share(["scenarios/no-such.clp", "scenarios", "README.md", "scenarios/test-scenario/domain.pddl"], 2),
)
def test_breakpoints_in_files_without_rules(client, name):
    client.launch(scenario="test-scenario")
    wanted = [{"line": line} for line in (1, 0, -5, 10**9)]
    answer = client.answer("setBreakpoints", source={"path": str(ROOT / name)}, breakpoints=wanted)
    if answer["success"]:
        assert all(not each["verified"] and each["message"] for each in answer["body"]["breakpoints"])
    else:
        assert "cannot read it" in answer["message"]
    client.break_at(GOALS, GOES_ON)
    client.begin()
    assert client.stopped()["description"] == "Stopped before rule talk-root-goes-on"


@pytest.mark.parametrize("when", ["before launch", "before it begins", "stopped", "running"])
def test_a_client_that_disconnects(client, when):
    if when == "before launch":
        client.ask("initialize", adapterID="cxbridge")
    else:
        client.launch(scenario="test-scenario")
        client.break_at(GOALS, *([GOES_ON] if when == "stopped" else []))
    if when in ("stopped", "running"):
        client.begin()
    if when == "stopped":
        client.stopped()
    client.send("disconnect")
    assert client.end() == 0
    assert "Traceback" not in client.stderr
