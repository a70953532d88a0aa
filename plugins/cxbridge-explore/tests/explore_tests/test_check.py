"""Checks of a scenario's world.yaml and properties.yaml."""

from __future__ import annotations

import shutil

import pytest

from cxbridge.run import RunOptions
from cxbridge_studio.check.run import check
from studio_tests.check.test_check import write_agent
from tests.support import ROOT, needs_plugin


@pytest.mark.parametrize(
    ("world", "line", "message"),
    [
        ("skils: []\n", 1, "skils"),
        ("skills:\n  - fails: 0.5\n", 2, "has no name"),
        ("skills:\n  - name: sey\n", 2, "there is no skill 'sey'"),
        ("sensed:\n  - interface: NoInterface::x\n    field: a\n    values: [1, 2]\n", 2, "NoInterface"),
        ("killed:\n  - agent: me\n    probability: 0.1\n", 2, "the scenario has one agent"),
        ("skills: [\n", 2, ""),
    ],
)
def test_invalid_world_is_error_with_line(tmp_path, world, line, message):
    (diagnostic,) = check(RunOptions(scenario=write_agent(tmp_path, world_yaml=world)))
    assert (diagnostic.code.name, diagnostic.place.file) == ("CX121", str(tmp_path / "world.yaml"))
    assert diagnostic.place.line == line
    assert message in diagnostic.message


@pytest.mark.parametrize(
    ("properties", "line", "message"),
    [
        ("- never (goal (mode FINISHED)\n", 1, ""),
        ("- no-deadlock\n", 1, ""),
        ("never: (goal)\n", 1, "the file must be a list of properties"),
        ("- a: never (fact)\n- a: never (other)\n", 0, "there are two properties 'a'"),
    ],
)
def test_invalid_property_is_error_with_line(tmp_path, properties, line, message):
    (diagnostic,) = check(RunOptions(scenario=write_agent(tmp_path, properties_yaml=properties)))
    assert (diagnostic.code.name, diagnostic.place.file) == ("CX122", str(tmp_path / "properties.yaml"))
    assert diagnostic.place.line == line
    assert message in diagnostic.message


def test_valid_world_and_properties_pass(tmp_path):
    folder = write_agent(
        tmp_path, world_yaml="skills:\n  - name: say\n    hangs: 0.1\n", properties_yaml="[]\n"
    )
    assert check(RunOptions(scenario=folder)) == []


@needs_plugin("robot-memory")
def test_world_of_several_agents_is_checked(tmp_path):
    shutil.copytree(ROOT / "scenarios" / "two-agents", tmp_path, dirs_exist_ok=True)
    world = tmp_path / "world.yaml"
    world.write_text("killed:\n  - agent: '*'\n    probability: 0.1\n")
    assert check(RunOptions(scenario=tmp_path)) == []
    world.write_text("killed:\n  - agent: unknown\n    probability: 0.1\n")
    (diagnostic,) = check(RunOptions(scenario=tmp_path))
    assert (diagnostic.code.name, diagnostic.place.line) == ("CX121", 2)
    assert "there is no agent 'unknown'" in diagnostic.message
