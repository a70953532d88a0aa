"""Transitions as text, a line for each."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from cxbridge.errors import TraceError
from cxbridge.events import GoalTransition, PlanActionTransition, SkillStatus
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.formats.transitions_text import (
    TransitionsText,
    TransitionsWriter,
    format_transition,
    parse_transition,
)
from tests.trace.runs import action, goal, skill

GOAL = GoalTransition(0, "executive", "gen8", "TALK", "nil", "nil", "FORMULATED", "UNKNOWN", "")
ACTION = PlanActionTransition(0, "executive", "10", "gen8", "gen8-PLAN", "say", "RUNNING")
SKILL = SkillStatus(0, "executive", "Skiller", 'say{text="Hello", wait=true}', 2, "S_RUNNING")


@pytest.mark.parametrize(
    ("event", "line"),
    [
        (GOAL, "goal gen8 class=TALK sub-type=nil parent=nil mode=FORMULATED outcome=UNKNOWN error="),
        (ACTION, "plan-action 10 goal=gen8 plan=gen8-PLAN action=say state=RUNNING"),
        (SKILL, 'SkillerInterface skill="say{text="Hello", wait=true}" msgid=2 status=S_RUNNING'),
        (
            replace(ACTION, env="robot 1"),
            "[robot 1] plan-action 10 goal=gen8 plan=gen8-PLAN action=say state=RUNNING",
        ),
        (
            replace(SKILL, env="robot1", skiller="arm"),
            '[robot1] SkillerInterface::arm skill="say{text="Hello", wait=true}" msgid=2 status=S_RUNNING',
        ),
    ],
)
def test_only_other_environment_and_skiller_are_named(event, line, tmp_path):
    assert format_transition(event) == line
    assert parse_transition(line) == event
    with TransitionsWriter(tmp_path / "run") as writer:
        writer.write(event)
    assert list(open_run(tmp_path / "run")) == [replace(event, time_us=1)]


WORDS = st.text("abcG-0*:", min_size=1, max_size=8)
NAMES = st.text("aB1 :-_=\"'", min_size=1, max_size=8)


@given(WORDS, NAMES, NAMES)
def test_transition_text_round_trips(word, env, skiller):
    for event in (
        replace(GOAL, env=env, goal=word, goal_class=word, error=env),
        replace(ACTION, env=env, action=word),
        replace(SKILL, env=env, skiller=skiller, skill_string=env),
    ):
        assert parse_transition(format_transition(event)) == event


def test_golden_run_keeps_values_and_times(tmp_path):
    first = goal("gen1", "FORMULATED", time_us=2_033_333)
    events = [
        first,
        replace(first, mode="SELECTED", priority="3", meta="(tried once)"),
        replace(action("gen1", "1", "PENDING"), time_us=3_000_000, params='(warn ") meta=(" "two\nlines")'),
        replace(skill("say{}", "S_RUNNING"), time_us=3_000_000),
        replace(action("gen1", "1", "RUNNING"), time_us=4_000_000, params="()"),
        replace(first, time_us=4_000_000, mode="FINISHED", priority="3", meta="()"),
    ]
    with TransitionsWriter(tmp_path / "golden", details=True, start_us=0) as writer:
        for event in events:
            writer.write(event)
    assert list(open_run(tmp_path / "golden")) == events
    assert (tmp_path / "golden").read_text().splitlines()[:6] == [
        "at 2.033333",
        "goal gen1 class=WORK sub-type=nil parent=nil mode=FORMULATED outcome=UNKNOWN error=",
        "  params=()",
        "goal gen1 class=WORK sub-type=nil parent=nil mode=SELECTED outcome=UNKNOWN error=",
        "  meta=(tried once)",
        "  priority=3",
    ]


def test_value_without_transition_is_error(tmp_path):
    (tmp_path / "golden").write_text(
        "  params=()\ngoal g class=A sub-type=nil parent=nil mode=M outcome=U error=\n"
    )
    with pytest.raises(TraceError, match="not a transition"):
        list(TransitionsText(tmp_path / "golden"))
