"""Clients that end the session in each phase."""

from __future__ import annotations

import pytest

from studio_tests.dap.conftest import GOALS, line_of

GOES_ON = line_of(GOALS, "(defrule talk-root-goes-on")


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
