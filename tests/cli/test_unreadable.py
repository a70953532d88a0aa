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


def test_unreadable_rules_are_an_error(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Such a file was skipped silently, and the agent was stuck."""
    scenario = write_scenario(tmp_path / "mini")
    rules = scenario / "mini.clp"
    rules.chmod(0)
    with unprivileged():
        assert invoke(["run", str(scenario)]) == 2
        assert f"{rules} cannot be read: Permission denied" in capfd.readouterr().err


@needs_plugin("studio")
def test_check_reports_unreadable_rules(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scenario = write_scenario(tmp_path / "mini")
    rules = scenario / "mini.clp"
    rules.chmod(0)
    with unprivileged():
        assert invoke(["check", str(scenario)]) == 1
        assert f"{rules} cannot be read: Permission denied" in capfd.readouterr().out
