"""A disconnection of the client in each phase of the session."""

from __future__ import annotations

import pytest

from studio_tests.dap.conftest import GOALS, find_line

ROOT_RULE_LINE = find_line(GOALS, "(defrule talk-root-goes-on")


@pytest.mark.parametrize("phase", ["before launch", "before start", "stopped", "running"])
def test_adapter_ends_after_disconnection(client, phase):
    if phase == "before launch":
        client.request("initialize", adapterID="cxbridge")
    else:
        client.launch(scenario="test-scenario")
        client.set_line_breakpoints(GOALS, *([ROOT_RULE_LINE] if phase == "stopped" else []))
    if phase in ("stopped", "running"):
        client.start_run()
    if phase == "stopped":
        client.wait_for_stop()
    client.send("disconnect")
    assert client.end() == 0
    assert "Traceback" not in client.stderr
