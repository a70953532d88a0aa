"""The limits of skills as the configuration sets them."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import fields

from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.run import RunOptions, run_scenario
from cxbridge.skiller.lua.limits import RANGES, Limits, read_limits
from tests.run.mini import write_scenario, write_skill_space


def test_what_is_not_configured_has_its_default():
    assert read_limits(Configuration.from_text("skiller: {skillspace: mine}")) == Limits()


def test_each_limit_is_configurable_and_has_a_range():
    assert set(RANGES) == {field.name for field in fields(Limits)}
    for name, (least, most) in RANGES.items():
        for value in (least, most):
            limits = read_limits(Configuration.from_text(f"skiller: {{limits: {{{name}: {value}}}}}"))
            assert getattr(limits, name) == value
        assert least <= getattr(Limits(), name) <= most


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("seconds_per_loop: 0", "/skiller/limits/seconds_per_loop cannot be 0"),
        ("seconds_per_loop: 1e9", r"seconds_per_loop cannot be 1e\+09"),
        ("seconds_per_loop: -1", "seconds_per_loop cannot be -1"),
        ("seconds_per_loop: .nan", "seconds_per_loop"),
        ("seconds_per_loop: long", "seconds_per_loop"),
        ("memory: 3", "/skiller/limits/memory cannot be 3"),
        ("memory: -3", "/skiller/limits/memory"),
        ("memory: {a: 3}", "/skiller/limits/memory"),
        ("second_per_loop: 1", "/skiller/limits/second_per_loop is not a limit"),
        ("a: {b: 1}", "/skiller/limits/a is not a limit"),
    ],
)
def test_a_slip_is_one_error_with_its_place(tmp_path: Path, text: str, message: str):
    file = tmp_path / "config.yaml"
    file.write_text(f"skiller:\n  limits:\n    {text}\n")
    with pytest.raises(ConfigError, match=message) as caught:
        read_limits(Configuration.load(file))
    assert (caught.value.file, caught.value.line) == (str(file), 3)


SLOW = """
function execute()
    for i = 1, 100000 do local x = i end
    return S_FINAL
end
function reset() end
"""


@pytest.mark.parametrize(("limit", "status"), [("10000", 1), ("50000000", 0)])
def test_a_run_has_the_limits_of_its_configuration(tmp_path: Path, limit: str, status: int):
    """One that is too small for a skill fails it; time is not tested, because machines are busy."""
    skills = write_skill_space(tmp_path / "lua", "slow", say=SLOW)
    folder = write_scenario(tmp_path / "scenario", space="slow")
    with (folder / "scenario.yaml").open("a") as file:
        file.write(f"skiller/limits: {{instructions_per_loop: {limit}, seconds_per_loop: 60}}\n")
    assert run_scenario(RunOptions(scenario=folder, skill_dirs=(skills,))).status == status
