"""The state of a recorded run after a number of events."""

from __future__ import annotations

from cxbridge.events import FactChange, InterfaceWrite, RuleFired
from cxbridge_studio.recorded_state import RunState
from tests.trace.runs import action, family, goal, skill


def make_fact(index, text, *, asserted=True, env="executive"):
    return FactChange(0, env, asserted, index, text[1:].split()[0].rstrip(")"), text)


def make_state(*events):
    state = RunState()
    for event in events:
        state.add_event(event)
    return state


def test_state_has_last_event_of_each_subject():
    state = make_state(
        *family(),
        InterfaceWrite(0, "T::a", {"n": 1}),
        InterfaceWrite(1, "T::a", {"n": 2}),
        skill("x", "S_FINAL"),
    )
    assert state.goals["executive", "gen1"].outcome == "COMPLETED"
    assert state.actions["executive", "gen1", "gen1-PLAN", "1"].state == "FINAL"
    assert state.interfaces["T::a"].values == {"n": 2}
    assert state.skills["executive", "Skiller"].skill_string == "x"
    assert state.last_firing is None


def test_goal_exists_as_long_as_its_recorded_fact():
    state = make_state(goal("g1", "FORMULATED"))
    assert state.has_goal("executive", "g1")
    assert not state.has_goal("executive", "g2")
    state.add_event(make_fact(1, "(goal (id g1) (class A))"))
    assert state.has_goal("executive", "g1")
    state.add_event(make_fact(1, "(goal (id g1) (class A))", asserted=False))
    assert not state.has_goal("executive", "g1")
    state.add_event(make_fact(2, "(goal cut off"))
    assert not state.has_goal("executive", "g1")


def test_copy_does_not_change():
    state = make_state(
        goal("g1", "FORMULATED"), make_fact(1, "(goal (id g1))"), RuleFired(0, "executive", 1, "r", "f-1")
    )
    copy = state.copy()
    for event in (
        goal("g1", "SELECTED"),
        goal("g2", "SELECTED"),
        action("g1", "1", "RUNNING"),
        make_fact(1, "(goal (id g1))", asserted=False),
        make_fact(2, "(more)"),
    ):
        state.add_event(event)
    assert copy.goals["executive", "g1"].mode == "FORMULATED"
    assert len(copy.goals) == 1
    assert not copy.actions
    assert list(copy.facts.by_env["executive"]) == [1]
    assert copy.has_goal("executive", "g1")
    assert copy.last_firing is not None
    assert copy.facts.templates == {"executive": {"goal"}}
