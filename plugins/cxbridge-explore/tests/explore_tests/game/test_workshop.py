"""Games of scenarios/workshop with a referee."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cxbridge.run.options import RunOptions
from cxbridge.testing.agent_run import AgentRun
from tests.support import ROOT

SCENARIO = ROOT / "scenarios" / "workshop"
GAME_TYPE = "GameInterface::Game"


def prepare_game(tmp_path: Path, **referee: Any) -> AgentRun:
    """Return a game with settings of the referee, before its start."""
    settings = ", ".join(f"{name}: {value}" for name, value in referee.items())
    config = tmp_path / "game.yaml"
    config.write_text(f"skill-board/agents/counter/executors/referee: {{{settings}}}\n")
    return AgentRun(RunOptions(scenario=SCENARIO, skiller="none", config=config), scripted=True)


@pytest.fixture
def short(tmp_path):
    """A game with two orders, oak and ash+red."""
    with prepare_game(tmp_path, seed=1, orders=2, minutes=3.0) as run:
        yield run


def play_to_end(run: AgentRun) -> dict[str, Any]:
    """Play to the end, and return the state of the game when the agent has seen the end."""
    run.until(lambda: any(goal.outcome != "UNKNOWN" for goal in run.goals("GAME")), timeout=400)
    return run.read(GAME_TYPE)


def test_game_completes_orders_and_violates_no_property(cx):
    run = cx.run(SCENARIO)
    run.assert_properties(
        "run-ends", "no-errors", "goals-retracted", "no-idle-rest", "preconditions", "executed-once"
    )
    assert {goal.outcome for goal in run.goals()} == {"COMPLETED"}
    assert len(run.goals("ORDER")) == 8
    carriers = {call.skiller for call in run.skills("take").calls}
    assert carriers == {"robot1", "robot2"}


def test_short_game_equals_golden(cx, tmp_path):
    config = tmp_path / "game.yaml"
    config.write_text("skill-board/agents/counter/executors/referee: {orders: 2, minutes: 3.0}\n")
    run = cx.run(SCENARIO, config=config)
    run.to_end()
    run.assert_golden()


def test_failed_order_leaves_no_piece(short):
    short.skills("paint").fails("no paint", times=3)
    game = play_to_end(short)
    outcomes = {goal.id: goal.outcome for goal in short.goals("ORDER")}
    assert outcomes == {"ORDER-1": "COMPLETED", "ORDER-2": "FAILED"}
    assert [goal.outcome for goal in short.goals("CLEAR")] == ["COMPLETED"]
    assert short.read("MachineInterface::booth")["piece"] == ""
    assert (game["deliveries"], game["points"]) == (1, 30)


def test_robot_drops_piece_of_failed_order(short):
    short.skills("put").fails("no room", times=3)
    play_to_end(short)
    assert [goal.outcome for goal in short.goals("DROP")] == ["COMPLETED"]
    assert {goal.id: goal.outcome for goal in short.goals("ORDER")}["ORDER-1"] == "FAILED"


def test_referee_refuses_wrong_piece(short):
    short.skills("paint").succeeds(after=1.0)  # the scripted skill paints nothing
    game = play_to_end(short)
    assert game["deliveries"] == 1
    assert "order2 is ash+red, not ash" in "".join(line.text for line in short.log)
