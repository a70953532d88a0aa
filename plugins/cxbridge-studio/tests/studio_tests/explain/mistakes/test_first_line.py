"""The first line of `why` has the cause, live, from the copy of a daemon, and from a recording."""

from __future__ import annotations

import json
from typing import Any

import pytest

from cxbridge.run import RunOptions, run_scenario
from cxbridge.trace.formats.registry import open_run
from cxbridge_studio.check.sources import load_scenario_rules
from cxbridge_studio.explain.answer import explain
from cxbridge_studio.explain.component import copy_evidence
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.explanation import Explanation
from cxbridge_studio.explain.recorded import RecordedEvidence
from cxbridge_studio.explain.scenario import EnvironmentEvidence, collect_scenario_evidence
from studio_tests.explain.mistakes.agents import MISTAKES, Mistake
from tests.support import ROOT, share

LENIENT: dict[str, Any] = {"strict": False}
"""A run with a broken rule continues."""


def ask_question(evidence: Evidence, mistake: Mistake) -> Explanation:
    """Return the explanation for the question of the author."""
    kind, _, name = mistake.question.rpartition(" ")
    return explain(evidence, name, kind)


def copy_like_daemon(evidence: EnvironmentEvidence, mistake: Mistake) -> Evidence:
    """Return the copy that a daemon makes for the question."""
    kind, _, name = mistake.question.rpartition(" ")
    times_us = evidence.start_us, evidence.now_us
    return copy_evidence(evidence.env, evidence.folders, name, kind, "a daemon", times_us, evidence.history)


def assert_has_cause(answer: Explanation, mistake: Mistake) -> None:
    """Assert that the first line has the cause, and the JSON document has the first line."""
    assert [word for word in mistake.cause if word not in answer.lines[0]] == [], answer.lines[0]
    assert answer.json_report["headline"] == answer.lines[0]
    json.dumps(answer.json_report)


@pytest.mark.parametrize("mistake", share(MISTAKES, 5), ids=lambda mistake: mistake.name)
def test_first_line_has_cause(mistake, tmp_path):
    agent, recording = mistake.write(tmp_path), tmp_path / "run.mcap"
    with collect_scenario_evidence(RunOptions(scenario=agent, **LENIENT), mistake.at) as evidence:
        assert_has_cause(ask_question(evidence, mistake), mistake)
        assert isinstance(evidence, EnvironmentEvidence)
        assert_has_cause(ask_question(copy_like_daemon(evidence, mistake), mistake), mistake)
    options = RunOptions(scenario=agent, trace=recording, trace_level="facts", timeout=mistake.at, **LENIENT)
    run_scenario(options)
    # A recording has no files that the spec does not load.
    needs_scenario = "does not load" in mistake.cause
    rules = load_scenario_rules(RunOptions(scenario=agent)) if needs_scenario else None
    assert_has_cause(ask_question(RecordedEvidence(open_run(recording), None, None, rules), mistake), mistake)


@pytest.mark.parametrize(
    "name",
    [
        "a function in the actions of a rule is misspelt: the rule is refused",
        "a file of the agent is not loaded",
    ],
)
def test_explanation_of_root_goal_has_cause(name, tmp_path):
    mistake = next(candidate for candidate in MISTAKES if candidate.name == name)
    with collect_scenario_evidence(
        RunOptions(scenario=mistake.write(tmp_path), **LENIENT), mistake.at
    ) as evidence:
        first_line = explain(evidence, "TESTGOAL-PARENT").lines[0]
    assert "talk-plan-for-talk" in first_line


@pytest.mark.parametrize("name", share(["TALK", "TESTGOAL-PARENT", "FINALLY-SUCCEED"], 1))
def test_explanation_of_correct_agent_names_no_mistake(name):
    """During the run, and at its end."""
    for at in (0.5, 2.0, None):
        with collect_scenario_evidence(
            RunOptions(scenario=ROOT / "scenarios" / "test-scenario"), at
        ) as evidence:
            answer = explain(evidence, name)
        text = "\n".join(answer.lines)
        for word in ("refused", "not load", "did you mean", "no rule executes", "precondition"):
            assert word not in text, answer.lines[0]
