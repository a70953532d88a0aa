"""The skill board as a part of runs and daemons."""

from __future__ import annotations

from typing import Any

import pytest

from cxbridge.daemon.options import DaemonOptions
from cxbridge.errors import ConfigError
from cxbridge.run import RunOptions, run_scenario
from cxbridge.skiller.calls import CallOutcome, SkillerCall
from tests.daemon.test_daemon import connected, running
from tests.run.mini import write_scenario

EXECUTORS = """
from cxbridge.skiller.board import SkillExecutor, SkillFailedError

class Say(SkillExecutor):
    skills = ("say",)
    known_settings = ("hoarse",)

    def execute(self, call):
        yield 0.5
        if self.setting("hoarse", False):
            raise SkillFailedError("no voice")
"""
BOARD = """
skill-board:
  agents:
    me:
      skiller: Skiller
      executors:
        say: {class: "executors.py:Say"}
"""


def write(folder, board=BOARD, **options):
    """The mini scenario, with a skill board."""
    write_scenario(folder, more=board, **options)
    (folder / "executors.py").write_text(EXECUTORS)
    return folder


def run(folder, **options):
    events: list[Any] = []
    result = run_scenario(RunOptions(scenario=folder, **options), console=events.append)
    return result, [event.text for event in events]


def test_agent_named_skiller_replaces_lua_skiller(tmp_path):
    """An agent written for the Skiller needs no change."""
    result, lines = run(write(tmp_path))
    assert (result.status, result.reason) == (0, "every root goal ended COMPLETED")
    assert not any("Skill space" in line for line in lines)


@pytest.mark.parametrize("skiller", ["none", "simulator"])
def test_skill_board_exists_beside_any_skiller(tmp_path, skiller):
    result, _ = run(write(tmp_path), skiller=skiller)
    assert result.status == 0


def test_feature_needs_skill_board(tmp_path):
    assert run(write(tmp_path / "with", feature="skill-board"))[0].status == 0
    with pytest.raises(ConfigError, match="skill-board"):
        run(write_scenario(tmp_path / "without", feature="skill-board"))


def test_skill_board_is_component_of_daemon(tmp_path):
    (tmp_path / "executors.py").write_text(EXECUTORS)
    config = tmp_path / "cxbridge.yaml"
    board = BOARD.replace("skiller: Skiller", "skiller: robot1")
    config.write_text(board.replace("skill-board:", "skill-board:\n  timeouts: {start: 1.0}"))
    given = DaemonOptions(
        config=config,
        settings=(
            ("fawkes/enable", False),
            ("skiller", "none"),
            ("zmq/endpoints", [f"ipc://{tmp_path}/board"]),
        ),
    )
    with running(given) as (daemon, _lines, outcome):
        with connected(daemon) as board:
            assert [info.id for info in board.list("ComponentInterface")][-1] == "skill-board"
            with SkillerCall(board, skiller="robot1") as call:
                assert call.execute("say{}", 20).outcome is CallOutcome.FINAL
                assert call.execute("sing{}", 20).error == "no executor of me offers sing; they offer: say"
        daemon.stop()
    assert outcome == [0]
