"""Unreadable files are a single error with the file's name, also from workers."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cxbridge.cli.main import invoke
from tests.run.mini import write_scenario
from tests.unprivileged import dark, unprivileged

__all__ = ["dark"]  # a fixture


@pytest.mark.parametrize(
    "command", ["explore SCENARIO --interface-dir", "explore SCENARIO --world", "explore"]
)
def test_unreadable_file_of_worker_is_error(
    command: str, dark: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    scenario = write_scenario(tmp_path / "mini")
    dark.chmod(0o444)  # the names of its files are readable, their contents are not
    path = dark if "--interface-dir" in command else dark / "more.yaml"
    words = [str(scenario) if word == "SCENARIO" else word for word in command.split()]
    with unprivileged():
        assert invoke([*words, str(path)]) == 2
    output = "".join(capfd.readouterr())
    assert "Traceback" not in output
    assert re.search(f"error: {dark}/[a-zA-Z.]+: Permission denied", output)


@pytest.mark.parametrize("command", ["explore", "sweep"])
def test_system_error_of_worker_is_error_of_command(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """A too long file name is an error for each user."""
    monkeypatch.chdir(tmp_path)
    scenario = write_scenario(tmp_path / "mini")
    assert invoke([command, str(scenario), "--config", f"{'x' * 300}.yaml"]) == 2
    output = "".join(capfd.readouterr())
    assert "Traceback" not in output
    assert "x.yaml: File name too long" in output
