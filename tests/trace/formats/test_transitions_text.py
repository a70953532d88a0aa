"""Transitions as text, one a line."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.events import GoalTransition, PlanActionTransition, SkillStatus
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.formats.transitions_text import TransitionsWriter, format_transition, parse_transition

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
def test_environment_and_skiller_are_named_unless_they_go_without_saying(event, line, tmp_path):
    assert format_transition(event) == line
    assert parse_transition(line) == event
    with TransitionsWriter(tmp_path / "run") as writer:
        writer.write(event)
    assert list(open_run(tmp_path / "run")) == [replace(event, time_us=1)]


WORDS = st.text("abcG-0*:", min_size=1, max_size=8)
NAMES = st.text("aB1 :-_=\"'", min_size=1, max_size=8)


@given(WORDS, NAMES, NAMES)
def test_what_is_written_is_read(word, env, skiller):
    for event in (
        replace(GOAL, env=env, goal=word, goal_class=word, error=env),
        replace(ACTION, env=env, action=word),
        replace(SKILL, env=env, skiller=skiller, skill_string=env),
    ):
        assert parse_transition(format_transition(event)) == event
