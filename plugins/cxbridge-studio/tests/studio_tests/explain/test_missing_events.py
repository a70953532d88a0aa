"""Runs without a possible next event end at once, and the results name the missing events."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cxbridge.run import RunOptions, run_scenario
from tests.run.mini import write_scenario


def run_to_end(scenario, **options):
    return run_scenario(RunOptions(scenario=scenario, **options))


def test_agent_without_goal_is_stuck_with_status_3(tmp_path):
    result = run_to_end(write_scenario(tmp_path, agent="(defrule nothing (never) =>)"))
    assert (result.status, result.reason) == (3, "nothing can happen any more: no goal has appeared")
    assert result.to_json()["result"] == "stuck"
    assert result.run_seconds < 2


@pytest.mark.parametrize(
    ("sub_type", "hint"),
    [
        ("RETRY-SUBGOAL", ": add goals/retry.clp to the files of the spec"),
        ("RETRY-SUBGOALS", ": did you mean RETRY-SUBGOAL?"),
        ("OTHER", ""),
    ],
)
@pytest.mark.parametrize("parent", ["nil", "TOP"])
def test_goal_with_unhandled_sub_type_is_stuck(tmp_path, sub_type, hint, parent):
    agent = f"""
    (defrule make (executive-initialized) =>
      (assert (goal (id TOP) (class TOP) (mode DISPATCHED)))
      (assert (goal (id G) (class WALK) (sub-type {sub_type}) (parent {parent}) (mode EXPANDED))))
    """
    result = run_to_end(write_scenario(tmp_path, agent=agent))
    causes = result.reason.removeprefix("nothing can happen any more: ").split("; ")
    reasons = [cause for cause in causes if "sub-type" in cause]
    assert [re.sub(r" \(\S+\)", "", cause) for cause in reasons] == [
        f"G is EXPANDED, and no rule handles its sub-type {sub_type}{hint}"
    ]


def test_agent_that_waits_for_time_is_not_stuck(tmp_path):
    wait = "(defrule wait (time ?now $?) (test (> ?now 2000000000)) =>)"
    result = run_to_end(write_scenario(tmp_path, agent=wait), timeout=5)
    assert (result.status, result.reason) == (3, "no goal has appeared after 5 s")


def test_initialisation_without_awaited_signal_is_stuck(tmp_path):
    scenario = write_scenario(tmp_path)
    config = scenario / "scenario.yaml"
    config.write_text(
        config.read_text().replace("- name: agent", "- name: agent\n            wait-for: godot")
    )
    result = run_to_end(scenario)
    assert result.status == 3
    place = f"{config}:14"
    assert result.reason == f"nothing can happen any more: {place}: agent waits for the signal godot"


def test_agent_without_goal_ends_run_of_team(tmp_path: Path) -> None:
    team = """
clips-executive/specs/idle/init/stage-3: [{name: none, files: []}]
cxbridge: {agents: {ann: {spec: idle}, ben: {}}}
"""
    scenario = write_scenario(tmp_path)
    with (scenario / "scenario.yaml").open("a") as file:
        file.write(team)
    result = run_to_end(scenario, timeout=30)
    assert (result.status, result.reason) == (
        3,
        "ann: nothing can happen any more: no goal has appeared",
    )
    assert result.spec == "idle mini"
    assert result.agents["ben"].status == 0
