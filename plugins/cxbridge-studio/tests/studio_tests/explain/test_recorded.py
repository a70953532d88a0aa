"""The evidence of a recording at a time: the facts of the time, and the rules of the attached files."""

from __future__ import annotations

import pytest

from cxbridge.errors import CxbridgeError, TraceError
from cxbridge_studio.explain.answer import explain
from cxbridge_studio.explain.recorded import RecordedEvidence
from cxbridge_studio.explain.rules.report import explain_rule, to_json
from tests.history.runs import ListRun, fact, fired, goal

FILES = {
    "world.clp": "(deftemplate robot (slot name) (multislot seen) (slot at))\n(defglobal ?*no* = taken)",
    "agent.clp": "(defrule drive ; go\n (robot (name ?n) (at ?p&~home)) (time ?) (test (free ?p)) =>)",
    "more.clp": "(deffunction free (?p) (neq ?p ?*no*))\n(defrule old (x) =>)(defrule old (y) =>)",
}
EVENTS = (
    goal(0, "g1", "FORMULATED"),
    fact(1, 1, '(robot (name "r") (seen) (at home))'),
    fact(2, 1, '(robot (name "r") (seen) (at home))', asserted=False),
    fact(2, 2, '(robot (name "r") (seen home) (at taken))'),
    fact(3, 3, "(time 3)"),
    fact(4, 2, '(robot (name "r") (seen home) (at taken))', asserted=False),
    fact(4, 4, '(robot (name "r") (seen home taken) (at dock))'),
    fired(5, "drive", "f-4,f-3"),
)


def count_joins(at, rule="drive", events=EVENTS):
    story = explain_rule(RecordedEvidence(ListRun(events, FILES), at, None), rule)
    assert story.diagnosis is not None
    return [element.joined.number if element.joined else None for element in story.diagnosis.elements], story


def test_joins_use_facts_of_the_time():
    assert count_joins(1.5)[0] == [0, None, None]
    assert count_joins(2.5)[0] == [1, 0, None]
    assert count_joins(3.5)[0] == [1, 1, 0]
    assert count_joins(4.5)[0] == [1, 1, 1]


def test_story_has_nearest_fact_position_and_notes():
    story = count_joins(1.5)[1]
    assert story.diagnosis is not None
    assert story.diagnosis.failure is not None
    (miss,) = story.diagnosis.failure.near
    assert miss.fact == 'f-1 (robot (name "r") (at home) ...)'
    assert story.position == ("/agent/agent.clp", 1)
    assert story.where == "list.mcap at 1.500 s"
    assert "no fact of 'time' was recorded: there was none, or it was not watched" in story.notes


def test_verdict_states_whether_match_fired():
    before, after = count_joins(4.5, events=(fired(0, "old"), *EVENTS))[1], count_joins(None)[1]
    assert "it had not fired for 1 of them, first f-4,f-3" in to_json(before)["verdict"]
    assert "it has fired for it" in to_json(after)["verdict"]
    assert to_json(after)["last_fired"] == {"seconds": 5.0, "facts": "f-4,f-3"}


def test_later_rule_replaces_earlier_rule_with_its_name():
    diagnosis = count_joins(None, "old")[1].diagnosis
    assert diagnosis is not None
    assert diagnosis.elements[0].text == "(y)"


@pytest.mark.parametrize(
    ("run", "message", "hint"),
    [
        (ListRun((), FILES), "this recording has no events", None),
        (ListRun(EVENTS), "this recording contains no CLIPS files", "name the scenario"),
    ],
)
def test_recording_without_events_or_files_is_an_error(run, message, hint):
    with pytest.raises(TraceError) as caught:
        explain(RecordedEvidence(run, None, None), "drive")
    assert message in caught.value.message
    assert hint is None or hint in str(caught.value.hint)


def test_verdict_without_facts_names_level_to_record():
    answer = explain(RecordedEvidence(ListRun([fired(1, "drive")], FILES), None, None), "drive")
    assert answer.json_report["fired"] == 1
    assert "whether its condition matches is unknown" in answer.json_report["verdict"]
    assert "record with --trace-level facts" in answer.json_report["verdict"]


def test_unknown_environment_is_an_error_with_names():
    with pytest.raises(TraceError, match="no CLIPS environment 'agent'") as caught:
        RecordedEvidence(ListRun(EVENTS), None, "agent")
    assert caught.value.hint == "there are: executive"


def test_unknown_name_without_rules_is_an_error():
    with pytest.raises(TraceError) as caught:
        explain(RecordedEvidence(ListRun(EVENTS), None, None), "drive")
    assert caught.value.message.startswith(
        "there is no goal 'drive'; the rules of the run are unknown: this recording contains no CLIPS files"
    )
    with pytest.raises(CxbridgeError, match="several goals begin with 'g'"):
        explain(RecordedEvidence(ListRun((*EVENTS, goal(9, "g2", "FORMULATED"))), None, None), "g")
