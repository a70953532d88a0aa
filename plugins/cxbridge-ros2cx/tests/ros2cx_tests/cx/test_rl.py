"""Agents of ``cx_rl_clips`` as environments of Gymnasium, with the block agent of the checkout."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cxbridge.errors import CxbridgeError
from tests.support import CX_DIR, ROOT, needs_cx

gymnasium = pytest.importorskip("gymnasium")

import cxbridge_ros2cx.rl  # noqa: E402 - registers the environment

pytestmark = needs_cx

CHECKOUT = Path(str(CX_DIR))
BRINGUP = CHECKOUT / "extensions/reinforment_learning/cx_rl_bringup"
PARAMS = BRINGUP / "params"
TOWER = ("stack(robot1#block2#block1)", "stack(robot1#block3#block2)", "stack(robot1#block4#block3)")


def make_environment(**settings):
    settings = {"parameters": PARAMS / "rl_agent.yaml", "ros2cx": CHECKOUT} | settings
    return gymnasium.make(cxbridge_ros2cx.rl.ENVIRONMENT_ID, **settings).unwrapped


@pytest.fixture(scope="module")
def blocks():
    environment = make_environment()
    yield environment
    environment.close()


def execute(blocks, *actions):
    """Execute actions, and return the last step."""
    step = ()
    for action in actions:
        step = blocks.step(blocks.actions.index(action))
    return step


def test_environment_passes_check_of_gymnasium(blocks):
    from gymnasium.utils.env_checker import check_env

    check_env(blocks, skip_render_check=True)


def test_spaces_have_all_groundings_in_original_order(blocks):
    objects = 4
    assert list(blocks.observables) == sorted(blocks.observables)
    assert len(blocks.observables) == objects * 5 + 1 + 2 * objects**2 - objects  # holding, on, target-on ...
    assert blocks.actions[0] == "no-op"
    assert blocks.actions[1:] == sorted(blocks.actions[1:])
    assert len(blocks.actions) == 1 + objects + objects**2
    assert {"holding(robot1#block1)", "on(block1#block1)", "can-hold(robot1)"} <= {*blocks.observables}


def test_step_changes_observations_by_rules(blocks):
    before, info = blocks.reset()
    assert info["robot"] == "robot1"
    assert {blocks.actions[number] for number in np.flatnonzero(info["action_mask"])} == {
        f"pickup(robot1#block{number})" for number in range(1, 5)
    }
    after, reward, terminated, truncated, info = execute(blocks, "pickup(robot1#block2)")
    changed = {name for name, index in blocks.observables.items() if before[index] != after[index]}
    assert changed == {"can-hold(robot1)", "on-table(block2)", "holding(robot1#block2)"}
    assert (reward, terminated, truncated, info["outcome"]) == (0.0, False, False, "")
    assert execute(blocks, TOWER[0])[1] == 100.0


def test_dead_end_ends_episode_with_failure_reward(blocks):
    blocks.reset()
    pairs = [("block2", "block1"), ("block4", "block3")]
    *_, info = execute(
        blocks, *(each for a, b in pairs for each in (f"pickup(robot1#{a})", f"stack(robot1#{a}#{b})"))
    )
    assert np.flatnonzero(info["action_mask"]).tolist() == [0]
    assert execute(blocks, "no-op")[1:3] == (-100.0, True)


def test_sample_of_manual_runs(tmp_path, monkeypatch):
    page = (ROOT / "docs" / "evidence" / "ros2-cx.md").read_text()
    section = page.partition("## Reinforcement learning")[2].partition("\n## ")[0]
    (training,) = re.findall(r"```python\n(.*?)```", section, re.DOTALL)
    (tmp_path / "clips_executive").symlink_to(CHECKOUT)
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(training, names)
    assert names["terminated"] is True
    assert [file.name for file in tmp_path.iterdir()] == ["clips_executive"]


def test_agent_without_interface_is_refused():
    with pytest.raises(CxbridgeError, match="no environment has the templates of cx_rl_clips") as raised:
        make_environment(parameters=CHECKOUT / "cx_tutorial_agents" / "params" / "hello_world.yaml")
    assert str(raised.value.file).endswith("hello_world.yaml")


def test_endless_action_is_reported_with_name(tmp_path):
    program = BRINGUP / "clips" / "cx_rl_bringup" / "rl-blocksworld.clp"
    lazy = program.read_text().replace("(modify ?action (is-finished TRUE) (reward ?reward))", "")
    (tmp_path / "lazy.clp").write_text(lazy)
    text = (PARAMS / "rl_agent.yaml").read_text()
    (tmp_path / "lazy.yaml").write_text(
        text.replace("clips/cx_rl_bringup/rl-blocksworld.clp", f"{tmp_path}/lazy.clp")
    )
    environment = make_environment(parameters=tmp_path / "lazy.yaml", patience=5.0)
    environment.reset()
    with pytest.raises(CxbridgeError, match="does not finish the action pickup"):
        execute(environment, "pickup(robot1#block2)")
    environment.close()
