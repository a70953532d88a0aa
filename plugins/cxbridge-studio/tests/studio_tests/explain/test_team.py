"""Explanations for scenarios with several agents."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge.run import RunOptions
from cxbridge_studio.check.sources import load_scenario_rules
from cxbridge_studio.explain.answer import explain
from cxbridge_studio.explain.scenario import collect_scenario_evidence
from tests.run.test_team import write


@pytest.mark.parametrize("name", ["ann", "ben"])
def test_each_agent_is_explained(tmp_path: Path, name: str) -> None:
    folder = write(tmp_path)
    with collect_scenario_evidence(RunOptions(scenario=folder), 1, name) as evidence:
        assert evidence.history.env == name
        text = "\n".join(explain(evidence, "G", "goal").lines)
        assert "DISPATCHED" in text
        assert "mini-dispatch" in text
        assert "mini-evaluate" in "\n".join(explain(evidence, "mini-evaluate", "rule").lines)
    rules = load_scenario_rules(RunOptions(scenario=folder), env=name)
    assert "mini-begin" in rules.rule_texts


@pytest.mark.parametrize("env", [None, "executive"])
def test_missing_or_unknown_agent_is_an_error_with_names(tmp_path: Path, env: str | None) -> None:
    folder = write(tmp_path)
    with (
        pytest.raises(CxbridgeError, match="--env NAME, one of: ann, ben"),
        collect_scenario_evidence(RunOptions(scenario=folder), 1, env),
    ):
        pass
