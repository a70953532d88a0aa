"""The text form of breakpoints, and the events that breakpoints match."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.errors import ExecutiveError
from cxbridge.events import GoalTransition, PlanActionTransition, SkillStatus
from cxbridge_studio.debugger.breakpoints import Breakpoint, describe_transition, parse_breakpoint

FAILED = GoalTransition(0, "executive", "gen5", "TALK", "SIMPLE", "nil", "FINISHED", "FAILED", "no voice")
MOVED = PlanActionTransition(0, "executive", "1", "gen5", "P", "move", "RUNNING")
SAID = SkillStatus(0, "executive", "Skiller", 'say{text="a:b"}', 7, "S_FAILED")


@pytest.mark.parametrize(
    ("spec", "event", "is_match"),
    [
        ("goal:TALK", FAILED, True),
        ("goal:gen5", FAILED, True),
        ("goal:T*:FINISHED", FAILED, True),
        ("goal:TALK:FINISHED:FAILED", FAILED, True),
        ("goal::FINISHED", FAILED, True),
        ("action:*:RUN*", MOVED, True),
        ("skill:say", SAID, True),
        ("skill:s?y:S_FAILED", SAID, True),
        ("skill:say{*", SAID, True),
        ('skill:say{text="a:b"}', SAID, True),
        ("goal:TALK:FINISHED:COMPLETED", FAILED, False),
        ("goal:TAL", FAILED, False),
        ("goal:TALK:SELECTED", FAILED, False),
        ("action:move:FINAL", MOVED, False),
        ("action:*", SAID, False),
        ("skill:*", MOVED, False),
        ("skill:sa", SAID, False),
        ("skill:say{}", SAID, False),
        ("skill:say*:S_FINAL", SAID, False),
        ("rule:*", FAILED, False),
    ],
)
def test_breakpoint_matches_transitions(spec, event, is_match):
    assert parse_breakpoint(spec).matches_transition(event) is is_match


def test_condition_follows_if():
    breakpoint_ = parse_breakpoint("rule:goal-* if (> ?*n* 3)")
    assert (breakpoint_.kind, breakpoint_.name, breakpoint_.condition) == ("before", "goal-*", "(> ?*n* 3)")
    assert breakpoint_.matches_rule("goal-x")
    assert not breakpoint_.matches_rule("a-goal-x")


@pytest.mark.parametrize("spec", ["", "goal", "goal:", "nothing:x", "rule:a:b", "goal:a:b:c:d", ":x", "rule"])
def test_invalid_breakpoint_is_an_error_with_hint(spec):
    with pytest.raises(ExecutiveError) as caught:
        parse_breakpoint(spec)
    assert "rule:NAME" in str(caught.value.hint)


WORDS = st.text("abcXYZ-_*?{}=\" '", min_size=1).filter(
    lambda text: text.strip() == text and " if " not in text
)


@given(st.sampled_from(["before", "after", "goal", "action", "skill"]), WORDS, st.booleans(), st.booleans())
def test_written_breakpoint_is_parsed_to_equal_breakpoint(kind, name, with_state, with_condition):
    breakpoint_ = Breakpoint(
        0,
        kind,
        name,
        "S_FINAL" if with_state and kind not in ("before", "after") else "*",
        condition="(a) if (b)" if with_condition else "",
    )
    assert parse_breakpoint(str(breakpoint_)) == breakpoint_


def test_transition_is_described_in_a_line():
    assert describe_transition(FAILED) == "goal gen5 (TALK) is FINISHED FAILED, error: no voice"
    assert describe_transition(MOVED) == "action move (gen5/P/1) is RUNNING"
    assert describe_transition(SAID) == 'skill say{text="a:b"} of Skiller is S_FAILED'
