"""scenarios/workshop: a whole game of production, with a referee and points."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cxbridge.run.options import RunOptions
from cxbridge.testing.agent_run import AgentRun
from tests.support import ROOT

SCENARIO = ROOT / "scenarios" / "workshop"
GAME_TYPE = "GameInterface::Game"


def played(tmp_path: Path, **referee: Any) -> AgentRun:
    """Return a game with other orders, which has not begun."""
    settings = ", ".join(f"{name}: {value}" for name, value in referee.items())
    config = tmp_path / "game.yaml"
    config.write_text(f"skill-board/agents/counter/executors/referee: {{{settings}}}\n")
    return AgentRun(RunOptions(scenario=SCENARIO, skiller="none", config=config), scripted=True)


@pytest.fixture
def short(tmp_path):
    """A game with two orders: oak; ash+red."""
    with played(tmp_path, seed=1, orders=2, minutes=3.0) as run:
        yield run


def end(run: AgentRun) -> dict[str, Any]:
    """Play to the end, and return how the game stood when the agent had seen its end."""
    run.until(lambda: any(goal.outcome != "UNKNOWN" for goal in run.goals("GAME")), timeout=400)
    return run.read(GAME_TYPE)


def test_a_whole_game_and_its_properties(cx):
    run = cx.run(SCENARIO)
    run.assert_properties(
        "run-ends", "no-errors", "goals-retracted", "no-idle-rest", "preconditions", "executed-once"
    )
    assert {goal.outcome for goal in run.goals()} == {"COMPLETED"}
    assert len(run.goals("ORDER")) == 8
    carried = {call.skiller for call in run.skills("take").calls}
    assert carried == {"robot1", "robot2"}


def test_a_short_game_is_the_golden_one(cx, tmp_path):
    config = tmp_path / "game.yaml"
    config.write_text("skill-board/agents/counter/executors/referee: {orders: 2, minutes: 3.0}\n")
    run = cx.run(SCENARIO, config=config)
    run.to_end()
    run.assert_golden()


def test_an_order_that_fails_leaves_nothing_behind(short):
    short.skills("paint").fails("no paint", times=3)
    game = end(short)
    outcomes = {goal.id: goal.outcome for goal in short.goals("ORDER")}
    assert outcomes == {"ORDER-1": "COMPLETED", "ORDER-2": "FAILED"}
    assert [goal.outcome for goal in short.goals("CLEAR")] == ["COMPLETED"]
    assert short.read("MachineInterface::booth")["piece"] == ""
    assert (game["deliveries"], game["points"]) == (1, 30)


def test_a_robot_that_keeps_the_piece_drops_it(short):
    short.skills("put").fails("no room", times=3)
    end(short)
    assert [goal.outcome for goal in short.goals("DROP")] == ["COMPLETED"]
    assert {goal.id: goal.outcome for goal in short.goals("ORDER")}["ORDER-1"] == "FAILED"


def test_the_referee_takes_no_wrong_piece(short):
    short.skills("paint").succeeds(after=1.0)  # by script: nothing is painted
    game = end(short)
    assert game["deliveries"] == 1
    assert "order2 is ash+red, not ash" in "".join(line.text for line in short.log)
