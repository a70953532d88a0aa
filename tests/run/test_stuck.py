"""Waiting runs: an explainer of a plug-in decides whether a run is stuck."""

from __future__ import annotations

import pytest

from cxbridge import plugins
from cxbridge.plugins import installed_plugins
from cxbridge.run import RunOptions, run_scenario
from cxbridge.run.result import RunResult, sum_up
from tests.plugins import forget, install
from tests.run.mini import write_scenario

TABLES = """
from cxbridge.plugins import Row
API = 1
EXPLAINERS = (Row("ears", "ears.explainer"),)
"""
EXPLAINER = """
def missing_events(agent, failed_rules):
    return "" if agent.clock.now_us() < agent.clock.start_us + 5_000_000 else "godot" + "".join(failed_rules)
"""


@pytest.fixture(name="explained")
def _explainer(tmp_path, monkeypatch):
    """An explainer that declares a run stuck after 5 s."""
    install(tmp_path / "site", monkeypatch, "ears", {"plugin.py": TABLES, "explainer.py": EXPLAINER})
    only = tuple(plugin for plugin in installed_plugins() if plugin.name == "ears")
    monkeypatch.setattr(plugins, "installed_plugins", lambda: only)
    yield
    forget("ears")


def run(folder, agent, timeout=30):
    return run_scenario(RunOptions(scenario=write_scenario(folder / "s", agent=agent), timeout=timeout))


@pytest.mark.usefixtures("explained")
def test_run_is_stuck_if_explainer_names_missing_events(tmp_path):
    """A team was "timed out" if its first agent was over, and repeated the note about that agent's goals."""
    result = run(tmp_path, "(defrule nothing (never) =>)")
    assert (result.status, result.reason, result.to_json()["result"]) == (
        3,
        "nothing can happen any more: godot",
        "stuck",
    )
    team = sum_up({"ann": RunResult(0, "over", "mini", (), 1, 1, 1.0, 1.0, None, {}, 3), "ben": result})
    assert (team.word, team.forgotten_goal_count) == ("stuck", 0)
    assert 5 <= result.run_seconds < 12  # the intervals between checks double


@pytest.mark.usefixtures("explained")
def test_explainer_gets_rules_with_errors(tmp_path):
    result = run(tmp_path, "(defrule broken (executive-initialized) => (/ 1 0))")
    assert result.reason == "nothing can happen any more: godotbroken"


@pytest.mark.usefixtures("explained")
def test_run_with_firing_rules_is_not_stuck(tmp_path):
    result = run(tmp_path, "(defrule count (time $?) => (assert (count (gensym*))))")
    assert (result.status, result.reason) == (3, "no goal has appeared after 30 s")
