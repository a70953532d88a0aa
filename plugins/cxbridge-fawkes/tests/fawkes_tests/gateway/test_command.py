"""Errors of the command `cxbridge gateway`; test_service.py tests a running gateway."""

from __future__ import annotations

import pytest

from cxbridge.cli.main import invoke


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["ipc:///x", "ipc:///y"], "--interface"),
        (["ipc:///x", "ipc:///x", "-i", "*"], "both sides are ipc:///x"),
        (["nonsense", "ipc:///y", "-i", "*"], "'nonsense' is not a blackboard's URL"),
        (["local:", "ipc:///y", "-i", ""], "Interface type may not be empty"),
    ],
)
def test_bad_input_gives_one_message_and_status_2(arguments, message, capsys):
    assert invoke(["gateway", *arguments]) == 2
    captured = capsys.readouterr()
    assert message in captured.err
    assert "Traceback" not in captured.err
