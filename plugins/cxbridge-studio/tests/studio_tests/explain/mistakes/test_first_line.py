"""The first line of the answer has the true cause, live, from a daemon's copy, and from a recording."""

from __future__ import annotations

import json
from typing import Any

import pytest

from cxbridge.run import RunOptions, run_scenario
from cxbridge.trace.formats.registry import open_run
from cxbridge_studio.check.sources import load_scenario_rules
from cxbridge_studio.explain.answer import explain
from cxbridge_studio.explain.answering import copy_evidence
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.explanation import Explanation
from cxbridge_studio.explain.recorded import RecordedEvidence
from cxbridge_studio.explain.scenario import EnvironmentEvidence, collect_scenario_evidence
from studio_tests.explain.mistakes.agents import MISTAKES, Mistake
from tests.support import ROOT, share

TO_THE_END: dict[str, Any] = {"strict": False}
"""A run with a broken rule continues."""


def asked(evidence: Evidence, mistake: Mistake) -> Explanation:
    """Ask the question of the agent's author."""
    kind, _, name = mistake.question.rpartition(" ")
    return explain(evidence, name, kind)


def copied(evidence: EnvironmentEvidence, mistake: Mistake) -> Evidence:
    """Return a daemon's copy for the question."""
    kind, _, name = mistake.question.rpartition(" ")
    times_us = evidence.start_us, evidence.now_us
    return copy_evidence(evidence.env, evidence.folders, name, kind, "a daemon", times_us, evidence.history)


def assert_tells(answer: Explanation, mistake: Mistake) -> None:
    """The first line has the cause, and so has the answer for programs."""
    assert [word for word in mistake.cause if word not in answer.lines[0]] == [], answer.lines[0]
    assert answer.data["headline"] == answer.lines[0]
    json.dumps(answer.data)


@pytest.mark.parametrize("mistake", share(MISTAKES, 5), ids=lambda mistake: mistake.name)
def test_the_true_cause_is_in_the_first_line(mistake, tmp_path):
    agent, recording = mistake.write(tmp_path), tmp_path / "run.mcap"
    with collect_scenario_evidence(RunOptions(scenario=agent, **TO_THE_END), mistake.at) as evidence:
        assert_tells(asked(evidence, mistake), mistake)
        assert isinstance(evidence, EnvironmentEvidence)
        assert_tells(asked(copied(evidence, mistake), mistake), mistake)
    options = RunOptions(
        scenario=agent, trace=recording, trace_level="facts", timeout=mistake.at, **TO_THE_END
    )
    run_scenario(options)
    # A recording does not know the files that the spec does not load.
    needs_scenario = "does not load" in mistake.cause
    rules = load_scenario_rules(RunOptions(scenario=agent)) if needs_scenario else None
    assert_tells(asked(RecordedEvidence(open_run(recording), None, None, rules), mistake), mistake)


@pytest.mark.parametrize(
    "name",
    [
        "a function in the actions of a rule is misspelt: the rule is refused",
        "a file of the agent is not loaded",
    ],
)
def test_the_cause_is_found_from_the_root_goal(name, tmp_path):
    mistake = next(each for each in MISTAKES if each.name == name)
    with collect_scenario_evidence(
        RunOptions(scenario=mistake.write(tmp_path), **TO_THE_END), mistake.at
    ) as evidence:
        first = explain(evidence, "TESTGOAL-PARENT").lines[0]
    assert "talk-plan-for-talk" in first


@pytest.mark.parametrize("name", share(["TALK", "TESTGOAL-PARENT", "FINALLY-SUCCEED"], 1))
def test_a_sound_agent_is_not_blamed(name):
    """While it runs, and at its end: no cause is made up."""
    for at in (0.5, 2.0, None):
        with collect_scenario_evidence(
            RunOptions(scenario=ROOT / "scenarios" / "test-scenario"), at
        ) as evidence:
            answer = explain(evidence, name)
        text = "\n".join(answer.lines)
        for word in ("refused", "not load", "did you mean", "no rule executes", "precondition"):
            assert word not in text, answer.lines[0]
