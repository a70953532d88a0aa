"""Several Skillers by name, and their settings for oddities of Fawkes."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.config import Configuration
from cxbridge.errors import ConfigError, CxbridgeError
from cxbridge.events import SkillStatus
from cxbridge.run import RunOptions, run_scenario
from cxbridge.run.skillers import SkillerSettings, skiller_settings
from cxbridge.trace.formats.registry import open_run
from tests.run.mini import AGENT, write_scenario

TWO = """
skiller/instances:
  robot1: {skillspace: test}
  robot2: {kind: simulator, mode: fawkes}
"""


def test_instances_inherit_settings():
    config = Configuration.from_text(TWO + "  robot3: {}\n")
    config.set("/skiller/mode", "strict")
    assert skiller_settings(config, "lua", made_elsewhere=("robot3", "Skiller")) == (
        SkillerSettings("robot1", "lua", "test", "strict"),
        SkillerSettings("robot2", "simulator", None, "fawkes"),
    )


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        ("skiller/mode: odd", "/skiller/mode cannot be 'odd'", "strict, fawkes"),
        ("skiller/instances/a: {kind: none}", "/skiller/instances/a/kind cannot be 'none'", "lua, simulator"),
        ("skiller/instances/a: {space: x}", "/skiller/instances/a/space is unknown", "skillspace"),
    ],
)
def test_misspelt_setting_is_one_error_with_place(text: str, message: str, hint: str):
    with pytest.raises(ConfigError, match=message) as caught:
        skiller_settings(Configuration.from_text(text), "lua")
    assert hint in str(caught.value)
    assert caught.value.line == 1


def two_robots(folder: Path, extra: str = TWO) -> Path:
    agent = AGENT.replace('(skiller-control (skiller "Skiller"))', '(skiller-control (skiller "robot1"))')
    agent = (
        agent.replace(
            "(action-name act)",
            '(action-name act) (skiller "robot1")',
        )
        .replace(
            '(param-names text) (param-values "hello")))',
            """(param-names text) (param-values "hello")))
  (assert (plan-action (id 2) (plan-id P) (goal-id G) (action-name act) (skiller "robot2")
                       (param-names text) (param-values "hello")))""",
        )
        .replace(
            "(assert (begun)",
            '(blackboard-open-reading "SkillerInterface" "robot1")\n'
            '  (blackboard-open-reading "SkillerInterface" "robot2")\n'
            '  (assert (begun) (skiller-control (skiller "robot2"))',
        )
        .replace(
            "  (skiller-control (acquired TRUE))",
            '  (skiller-control (skiller "robot1") (acquired TRUE))\n'
            '  (skiller-control (skiller "robot2") (acquired TRUE))',
        )
    )
    return write_scenario(folder, agent=agent, more=extra)


def test_plan_runs_on_two_skillers(tmp_path: Path):
    trace = tmp_path / "run.mcap"
    result = run_scenario(RunOptions(scenario=two_robots(tmp_path / "two"), trace=trace))
    assert result.status == 0
    seen = [(event.skiller, event.status) for event in open_run(trace) if isinstance(event, SkillStatus)]
    assert [item for item in seen if item[1] != "S_INACTIVE"] == [
        ("robot1", "S_RUNNING"),
        ("robot1", "S_FINAL"),
        ("robot2", "S_RUNNING"),
        ("robot2", "S_FINAL"),
    ]


def test_missing_second_skiller_fails_its_action_only(tmp_path: Path):
    folder = two_robots(tmp_path / "two", "skiller/instances: {robot1: {}, other: {}}\n")
    result = run_scenario(RunOptions(scenario=folder, timeout=5))
    assert result.status == 3
    assert "FORMULATED" in result.reason


def test_two_writers_of_interface_are_one_error(tmp_path: Path):
    """An interface has one writer on any blackboard."""
    folder = two_robots(tmp_path / "two", TWO.replace("test", "greedy").replace("kind: simulator, ", ""))
    skills = tmp_path / "skills"
    skills.mkdir()
    (skills / "greedy.lua").write_text(
        "blackboard:open_for_writing('TestInterface', 'mine')\nmodule(..., skillenv.module_init)\n"
    )
    settings = folder / "scenario.yaml"
    settings.write_text(settings.read_text().replace("skillspace: test", "skillspace: greedy"))
    with pytest.raises(CxbridgeError, match="mine"):
        run_scenario(RunOptions(scenario=folder, skill_dirs=(skills,)))


@pytest.mark.parametrize(
    ("settings", "status"),
    [
        ("skiller/mode: strict", 0),
        ("skiller/mode: fawkes", 0),
        ("skiller/mode: fawkes\ncxbridge/remote-programs: false", 0),
        ("skiller/mode: fawkes\ncxbridge/remote-programs: true", 1),
        ("skiller/mode: strict\ncxbridge/remote-programs: true", 0),
    ],
)
def test_value_is_pasted_only_in_mode_fawkes(tmp_path: Path, settings: str, status: int):
    """A quote in an object's name ends the skill string's text in Fawkes, which then does not compile."""
    folder = write_scenario(tmp_path, agent=AGENT.replace('"hello"', r'"hel\"lo"'), more=f"{settings}\n")
    assert run_scenario(RunOptions(scenario=folder)).status == status
