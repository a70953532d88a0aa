"""The check of the example plug-in in docs/plugins.md."""

from __future__ import annotations

import pytest

from cxbridge.run import RunOptions
from cxbridge_studio.check.run import check
from cxbridge_studio.check.table import load_codes
from tests.plugins import example, forget, install
from tests.run.mini import write_scenario


@pytest.fixture
def greeter(tmp_path, monkeypatch):
    install(tmp_path / "site", monkeypatch, "greeter", example())
    yield
    forget("greeter")


def test_check_of_plugin_has_code_and_finding(greeter, tmp_path):
    folder = write_scenario(tmp_path / "s")
    assert "GR1" in load_codes()
    assert check(RunOptions(scenario=folder), errors_only=True) == []
    with (folder / "scenario.yaml").open("a") as file:
        file.write('greeting: ""\n')
    (finding,) = check(RunOptions(scenario=folder), errors_only=True)
    assert (finding.code.name, finding.place.file) == ("GR1", str(folder / "scenario.yaml"))
