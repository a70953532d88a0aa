"""How a run stands at one of its moments."""

from __future__ import annotations

from cxbridge.events import FactChange, InterfaceWrite, RuleFired
from cxbridge_studio.recorded_state import RunState
from tests.trace.runs import action, family, goal, skill


def fact(index, text, *, asserted=True, env="executive"):
    return FactChange(0, env, asserted, index, text[1:].split()[0].rstrip(")"), text)


def state(*events):
    made = RunState()
    for event in events:
        made.add_event(event)
    return made


def test_the_last_of_each_counts():
    made = state(
        *family(),
        InterfaceWrite(0, "T::a", {"n": 1}),
        InterfaceWrite(1, "T::a", {"n": 2}),
        skill("x", "S_FINAL"),
    )
    assert made.goals["executive", "gen1"].outcome == "COMPLETED"
    assert made.actions["executive", "gen1", "gen1-PLAN", "1"].state == "FINAL"
    assert made.interfaces["T::a"].values == {"n": 2}
    assert made.skills["executive", "Skiller"].skill_string == "x"
    assert made.rule is None


def test_a_goal_is_there_as_long_as_its_fact_where_facts_are_recorded():
    made = state(goal("g1", "FORMULATED"))
    assert made.has_goal("executive", "g1")
    assert not made.has_goal("executive", "g2")
    made.add_event(fact(1, "(goal (id g1) (class A))"))
    assert made.has_goal("executive", "g1")
    made.add_event(fact(1, "(goal (id g1) (class A))", asserted=False))
    assert not made.has_goal("executive", "g1")
    made.add_event(fact(2, "(goal cut off"))
    assert not made.has_goal("executive", "g1")


def test_a_copy_stays_as_it_was():
    made = state(
        goal("g1", "FORMULATED"), fact(1, "(goal (id g1))"), RuleFired(0, "executive", 1, "r", "f-1")
    )
    copy = made.copy()
    for event in (
        goal("g1", "SELECTED"),
        goal("g2", "SELECTED"),
        action("g1", "1", "RUNNING"),
        fact(1, "(goal (id g1))", asserted=False),
        fact(2, "(more)"),
    ):
        made.add_event(event)
    assert copy.goals["executive", "g1"].mode == "FORMULATED"
    assert len(copy.goals) == 1
    assert not copy.actions
    assert list(copy.facts.by_env["executive"]) == [1]
    assert copy.has_goal("executive", "g1")
    assert copy.rule is not None
    assert copy.facts.templates == {"executive": {"goal"}}
