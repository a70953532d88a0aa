"""An unreadable file is one error with its name, for users other than root."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.cli.main import invoke
from tests.run.mini import write_scenario
from tests.support import needs_plugin
from tests.unprivileged import dark, unprivileged

__all__ = ["dark"]  # a fixture


@pytest.mark.parametrize(
    "command",
    [
        "run",
        *(pytest.param(command, marks=needs_plugin("studio")) for command in ("check", "why mini-begin")),
    ],
)
def test_configuration_in_unsearchable_folder_is_an_error(
    command: str, dark: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    scenario = write_scenario(tmp_path / "mini")
    with unprivileged():
        status = invoke([*command.split(), str(scenario), "--config", str(dark / "more.yaml")])
    printed = "".join(capfd.readouterr())
    assert (status, "Traceback" in printed) == (2, False)
    assert f"{dark / 'more.yaml'}: Permission denied" in printed


@pytest.mark.parametrize(
    ("command", "status", "stream"),
    [("run", 2, "err"), pytest.param("check", 1, "out", marks=needs_plugin("studio"))],
)
def test_unreadable_rules_are_an_error(
    command: str, status: int, stream: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Such a file was skipped silently, and the agent was stuck."""
    scenario = write_scenario(tmp_path / "mini")
    rules = scenario / "mini.clp"
    rules.chmod(0)
    with unprivileged():
        assert invoke([command, str(scenario)]) == status
        assert f"{rules} cannot be read: Permission denied" in getattr(capfd.readouterr(), stream)
