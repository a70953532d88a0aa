"""Several agents in one run, and one agent of several alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cxbridge.config import Configuration
from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.options import DaemonOptions
from cxbridge.errors import ConfigError, CxbridgeError
from cxbridge.events import InterfaceWrite, LogLine, PlanActionTransition, SkillStatus
from cxbridge.run import RunOptions, run_scenario
from cxbridge.run.agents import agent_names, choose_agent
from cxbridge.trace.formats.registry import open_run
from tests.daemon.test_daemon import running
from tests.run.mini import write_scenario

TWO = "\ncxbridge: {agents: {ann: {}, ben: {}}}\n"


def write(folder: Path, more: str = TWO, **options: Any) -> Path:
    """The mini scenario, for two agents."""
    return write_scenario(folder, more=more, **options)


def run(folder: Path, **options: Any) -> tuple[Any, list[LogLine]]:
    lines: list[Any] = []
    return run_scenario(RunOptions(scenario=folder, **options), console=lines.append), lines


def test_each_agent_has_skiller_named_skiller(tmp_path: Path) -> None:
    """An agent written for one Fawkes needs no change."""
    trace = tmp_path / "run.mcap"
    result, lines = run(write(tmp_path / "s"), trace=trace)
    assert (result.status, result.reason) == (0, "every root goal ended COMPLETED")
    events = list(open_run(trace))
    for agent in ("ann", "ben"):
        actions = [e for e in events if isinstance(e, PlanActionTransition) and e.env == agent]
        assert actions[-1].state == "FINAL"
        ran = {e.skiller for e in events if isinstance(e, SkillStatus) and e.env == agent}
        assert ran == {"Skiller"}
        assert f"SkillerInterface::{agent}/Skiller" in {
            e.uid for e in events if isinstance(e, InterfaceWrite)
        }
    components = {line.component for line in lines}
    assert {"CLIPS (ann)", "ben/ClipsExecutiveThread"} <= components
    assert not any(name.startswith("ann/CLIPS (") for name in components)


def test_result_has_results_of_agents(tmp_path: Path) -> None:
    more = """
cxbridge:
  agents:
    ann: {config: {clips-executive/specs/mini/action-mapping/act: 'fail{}'}}
    ben: {}
"""
    result, _ = run(write(tmp_path, more))
    assert (result.status, result.reason) == (1, "ann: G ended FAILED")
    assert {name: agent.status for name, agent in result.agents.items()} == {"ann": 1, "ben": 0}
    report = result.to_json()
    assert [goal["outcome"] for goal in report["agents"]["ben"]["goals"]] == ["COMPLETED"]
    assert report["goals"] == []
    told_people = result.summary().splitlines()
    assert told_people[:2] == ["ann", "  G (MINI): FAILED  [ACTION-FAILED]"]
    assert told_people[2:4] == ["ben", "  G (MINI): COMPLETED"]


def test_agent_runs_alone(tmp_path: Path) -> None:
    folder = write(tmp_path)
    result, lines = run(folder, agent="ben")
    assert (result.status, result.agents) == (0, {})
    assert "CLIPS (ben)" in {line.component for line in lines}
    with pytest.raises(CxbridgeError, match="no agent 'tom'") as refused:
        run(folder, agent="tom")
    assert "it has: ann, ben" in str(refused.value)
    with pytest.raises(CxbridgeError, match="no agent 'ben'"):
        run(write_scenario(tmp_path / "one"), agent="ben")


@pytest.mark.parametrize(
    ("agents", "words"),
    [
        ("{ann: 5}", "/cxbridge/agents/ann must be a map"),
        ("{ann: {specs: x}}", "/cxbridge/agents/ann/specs is unknown"),
        ("{'a b': {}}", "is not a valid name of an agent"),
        ("{executive: {}}", "is not a valid name of an agent"),
    ],
)
def test_invalid_agents_are_errors(agents: str, words: str) -> None:
    config = Configuration.from_text(f"cxbridge:\n  agents: {agents}\n", "f.yaml")
    with pytest.raises(ConfigError, match=words) as refused:
        agent_names(config)
    assert refused.value.line == 2
    assert str(refused.value.file) == "f.yaml"


@pytest.mark.parametrize("options", [{}, {"agent": "ben"}])
def test_warning_of_configuration_is_logged_once(tmp_path: Path, options: dict[str, str]) -> None:
    _, lines = run(write(tmp_path, TWO + "skiller: {skillspace: test}\n"), **options)
    assert len([line for line in lines if "'skiller' replaces" in line.text]) == 1


def test_list_is_no_configuration_of_agent() -> None:
    config = Configuration.from_text("a: 1\ncxbridge/agents: {ann: {config: [{a: 2}]}}", "f.yaml")
    with pytest.raises(ConfigError, match="is a list of maps"):
        choose_agent(config, "ann")


def test_configurations_of_agents_are_separate() -> None:
    config = Configuration.from_text(
        "a: {b: 1, c: [x]}\ncxbridge/agents: {ann: {spec: s, config: {a: {b: 2}}}, ben: {}}", "f.yaml"
    )
    ann, ben = (choose_agent(config, name) for name in agent_names(config))
    assert (ann.get_uint("/a/b"), ben.get_uint("/a/b"), config.get_uint("/a/b")) == (2, 1, 1)
    assert ann.get_strings("/a/c") == ["x"]
    assert (ann.get_str("/fawkes/agent/name"), ben.get_str("/fawkes/agent/name")) == ("ann", "ben")
    assert ann.get_str("/clips-executive/spec") == "s"
    assert not config.exists("/fawkes/agent/name")


def test_daemon_runs_agent_of_team(tmp_path: Path) -> None:
    folder = write(tmp_path)
    with running(config=folder, agent="ben", settings=(("fawkes/enable", False),)) as (daemon, _, _):
        assert daemon.config.get_str("/fawkes/agent/name") == "ben"
        assert daemon.spec == "mini"
    with pytest.raises(ConfigError, match="several agents") as refused:
        Daemon(DaemonOptions(config=folder))
    assert "--agent" in str(refused.value)


def test_replay_of_team_is_refused(tmp_path: Path) -> None:
    folder, recording = write(tmp_path), tmp_path / "run.mcap"
    run(folder, trace=recording)
    for options in ({}, {"agent": "ann"}):
        with pytest.raises(CxbridgeError, match="several agents is not replayed"):
            run(folder, replay=(recording,), **options)


def test_replay_of_single_agent_of_team(tmp_path: Path) -> None:
    folder, recording = write(tmp_path), tmp_path / "run.mcap"
    run(folder, trace=recording, agent="ann")
    again, _ = run(folder, replay=(recording,), agent="ann")
    assert (again.status, again.replay.same) == (0, True)
