"""Following the goals of an environment."""

from __future__ import annotations

import pytest

from cxbridge.executive.goals import GoalWatch

TEMPLATE = """(deftemplate goal (slot id) (slot class) (slot parent (default nil))
 (slot mode (default FORMULATED))
 (slot outcome (default UNKNOWN)) (multislot error) (slot message (default "")))"""


@pytest.fixture
def goals(env):
    env.build(TEMPLATE)
    return GoalWatch(env)


def test_root_ends_with_mode_retracted_or_without_fact(env, goals):
    first = env.assert_string("(goal (id a) (class A))")
    second = env.assert_string("(goal (id b) (class B))")
    goals.record_ended_goals()
    assert [root.goal for root in goals.open_roots] == ["a", "b"]
    env.eval(f"(modify {first} (mode RETRACTED) (outcome COMPLETED))")
    goals.record_ended_goals()
    assert [root.goal for root in goals.open_roots] == ["b"]
    env.retract(second)
    goals.record_ended_goals()
    assert not goals.open_roots
    assert goals.outcome_counts == {"COMPLETED": 1, "UNKNOWN": 1}


def test_retracted_root_is_counted_once(env, goals):
    fact = env.assert_string("(goal (id a) (class A))")
    env.eval(f"(modify {fact} (mode RETRACTED) (outcome FAILED) (error X 1))")
    goals.record_ended_goals()
    goals.record_ended_goals()
    ((modified, _, _),) = env.facts("goal")  # a modify makes another fact, as in CLIPS 6.30
    env.retract(modified)
    goals.record_ended_goals()
    assert goals.outcome_counts == {"FAILED": 1}
    assert [(state.goal, state.error) for state in goals.ended_roots] == [("a", "X 1")]
    assert goals.open_goals == {}


def test_repeated_goal_is_counted_once(env, goals):
    env.assert_string("(goal (id a) (class A) (mode RETRACTED) (outcome FAILED))")
    env.eval("(do-for-fact ((?g goal)) TRUE (modify ?g (mode FORMULATED) (outcome UNKNOWN)))")
    goals.record_ended_goals()
    assert [(state.goal, state.mode) for state in goals.all_states()] == [("a", "FORMULATED")]
    assert [root.goal for root in goals.open_roots] == ["a"]


def test_new_goal_with_old_id_is_counted_separately(env, goals):
    env.assert_string("(goal (id a) (class A) (mode RETRACTED) (outcome FAILED))")
    env.eval("(do-for-fact ((?g goal)) TRUE (retract ?g) (assert (goal (id a) (class A))))")
    goals.record_ended_goals()
    assert [(state.goal, state.outcome) for state in goals.all_states()] == [
        ("a", "FAILED"),
        ("a", "UNKNOWN"),
    ]
    assert goals.outcome_counts == {"FAILED": 1}


def test_goal_with_late_id_is_counted_once(env, goals):
    env.assert_string("(goal (id nil) (class A))")
    env.eval("(do-for-fact ((?g goal)) TRUE (modify ?g (id A-gen1)))")
    goals.record_ended_goals()
    assert [state.goal for state in goals.all_states()] == ["A-gen1"]
    assert [root.goal for root in goals.open_roots] == ["A-gen1"]
    assert goals.outcome_counts == {}


def test_sub_goals_are_not_counted(env, goals):
    env.assert_string("(goal (id a) (class A))")
    child = env.assert_string("(goal (id b) (class B))")
    env.eval(f"(modify {child} (parent a))")
    goals.record_ended_goals()
    env.retract(child)
    goals.record_ended_goals()
    assert goals.outcome_counts == {}
    assert [root.goal for root in goals.roots] == ["a"]
