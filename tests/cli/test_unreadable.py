"""What one may not read is one error that names it: root sees no such mistakes, everybody else does."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from cxbridge.cli.main import invoke
from tests.run.mini import write_scenario
from tests.unprivileged import unprivileged


@pytest.fixture(name="dark")
def _dark(tmp_path: Path) -> Iterator[Path]:
    """Return a folder that may not even be searched."""
    folder = tmp_path / "dark"
    folder.mkdir()
    (folder / "more.yaml").write_text("a: 1\n")
    folder.chmod(0)
    yield folder
    folder.chmod(0o755)


@pytest.mark.parametrize("command", ["run", "explore", "check", "why mini-begin"])
def test_a_configuration_in_a_folder_that_may_not_be_searched(
    command: str, dark: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    scenario = write_scenario(tmp_path / "mini")
    with unprivileged():
        status = invoke([*command.split(), str(scenario), "--config", str(dark / "more.yaml")])
    printed = "".join(capfd.readouterr())
    assert (status, "Traceback" in printed) == (2, False)
    assert f"{dark / 'more.yaml'}: Permission denied" in printed


@pytest.mark.parametrize("command", ["explore OWN --interface-dir", "explore OWN --world", "explore"])
def test_what_another_process_may_not_read(
    command: str, dark: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The process ended with a traceback, beside an error that said nothing."""
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


def test_a_file_of_rules(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """It was passed over silently, and the agent was stuck."""
    scenario = write_scenario(tmp_path / "mini")
    rules = scenario / "mini.clp"
    rules.chmod(0)
    with unprivileged():
        assert invoke(["run", str(scenario)]) == 2
        assert f"{rules} cannot be read: Permission denied" in capfd.readouterr().err
        assert invoke(["check", str(scenario)]) == 1
        assert f"{rules} cannot be read: Permission denied" in capfd.readouterr().out
