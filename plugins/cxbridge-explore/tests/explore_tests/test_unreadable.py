"""Files that the user may not read: one error names the file, from workers, too."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cxbridge.cli.main import invoke
from tests.run.mini import write_scenario
from tests.unprivileged import dark, unprivileged

__all__ = ["dark"]  # a fixture


@pytest.mark.parametrize("command", ["explore OWN --interface-dir", "explore OWN --world", "explore"])
def test_what_another_process_may_not_read(
    command: str, dark: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The process ended with a traceback, with an empty error."""
    scenario = write_scenario(tmp_path / "mini")
    dark.chmod(0o444)  # its files have names, but no more
    place = dark if "--interface-dir" in command else dark / "more.yaml"
    words = [str(scenario) if word == "OWN" else word for word in command.split()]
    with unprivileged():
        assert invoke([*words, str(place)]) == 2
    printed = "".join(capfd.readouterr())
    assert "Traceback" not in printed
    assert re.search(f"error: {dark}/[a-zA-Z.]+: Permission denied", printed)


@pytest.mark.parametrize("what", ["explore", "sweep"])
def test_an_error_of_the_system_crosses_from_worker_to_command(
    what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """No privileges are needed here: the name of a file may be too long for any system."""
    monkeypatch.chdir(tmp_path)
    scenario = write_scenario(tmp_path / "mini")
    assert invoke([what, str(scenario), "--config", f"{'x' * 300}.yaml"]) == 2
    printed = "".join(capfd.readouterr())
    assert "Traceback" not in printed
    assert "x.yaml: File name too long" in printed
