"""The debugger on an environment of a few rules."""

from __future__ import annotations

import threading

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.errors import ClipsError, ExecutiveError
from cxbridge.events import EventBus, GoalTransition, RuleFired, SkillStatus
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge_studio.debugger.debugger import Debugger
from cxbridge_studio.debugger.fact_editing import assert_text
from tests.hostile.test_clips_files import CRASHING_TEXTS

RULES = """
(deftemplate count (slot n) (multislot of))
(defrule one (one) => (assert (two)))
(defrule two (two) => (assert (three)))
(defrule three (three) => (assert (done)))
(defrule told ?t <- (tell $?what) => (retract ?t) (tell-goal (nth$ 1 ?what) (nth$ 2 ?what)) (assert (heard)))
(defrule heard (heard) => (assert (done)))
(defrule skilled ?t <- (skill ?status) => (retract ?t) (tell-skill ?status))
"""


@pytest.fixture(name="env")
def _env():
    bus = EventBus(VirtualClock())
    env = ClipsEnvironment("executive", bus)
    env.define(
        "tell-goal",
        lambda goal, mode: bus.emit(GoalTransition(0, "executive", goal, "TALK", "", "nil", mode, "", "")),
        2,
    )
    env.define(
        "tell-skill", lambda status: bus.emit(SkillStatus(0, "executive", "Skiller", "say{}", 1, status)), 1
    )
    for construct in RULES.strip().splitlines():
        env.build(construct)
    yield env
    env.destroy()


@pytest.fixture(name="debugger")
def _debugger(env):
    return Debugger(env)


def fired(env):
    """The rules that fire from now on."""
    rules = []
    env.bus.subscribe(lambda event: rules.append((event.number, event.rule)), RuleFired)
    env.watcher.rules.set((), on=True)
    env.watcher.set_hooks()
    return rules


def stands(debugger):
    return debugger.stopped is not None


def has(env, relation):
    return any(True for _ in env.facts(relation))


def test_before_a_rule(env, debugger):
    rules = fired(env)
    debugger.add("rule:tw*")
    env.assert_string("(one)")
    assert debugger.run() == 1
    stop = debugger.stopped
    assert (stop.kind, stop.reason, stop.breakpoint) == ("before", "before rule two", 1)
    assert (stop.rule, stop.next_rule, stop.fired, stop.loop) == ("one", "two", 1, 1)
    assert debugger.run() == 0  # it stands
    debugger.go_on()
    assert debugger.run() == 2
    assert not stands(debugger)
    assert rules == [(1, "one"), (2, "two"), (3, "three")]  # numbered as in one run


def test_after_a_rule_and_before_the_next(env, debugger):
    debugger.add("after:one")
    debugger.add("before:two")
    env.assert_string("(one)")
    reasons = []
    while debugger.run() or debugger.stopped:
        if debugger.stopped:
            reasons.append(debugger.stopped.reason)
        debugger.go_on()
    assert reasons == ["after rule one", "before rule two"]


def test_at_a_transition_after_the_rule_that_made_it(env, debugger):
    debugger.add("goal:TALK:FINISHED")
    env.assert_string("(tell a SELECTED)")
    debugger.run()
    assert not stands(debugger)
    env.assert_string("(tell b FINISHED)")
    debugger.run()
    stop = debugger.stopped
    assert (stop.kind, stop.reason, stop.rule) == ("transition", "at goal b (TALK) is FINISHED", "told")
    assert (stop.event.goal, stop.next_rule) == ("b", "")


def test_the_rest_of_the_agenda_waits_at_a_transition(env, debugger):
    debugger.add("goal:*")
    env.assert_string("(tell a SELECTED)")
    assert debugger.run() == 1
    assert debugger.stopped.next_rule == "heard"
    assert not has(env, "done")
    debugger.go_on()
    assert debugger.run() == 1
    assert has(env, "done")


def test_a_right_hand_side_that_fails_at_a_transition_stops_too(env, debugger):
    env.build(
        "(defrule bad (bad) => (tell-goal x SELECTED) (assert (one)) (str-cat (nth$ 1 (create$ a)) (/ 1 0)))"
    )
    debugger.add("goal:x")
    env.assert_string("(one)")
    env.assert_string("(bad)")
    debugger.run()
    assert debugger.stopped.rule == "bad"


def test_a_skill_is_told_when_its_status_changes(env, debugger):
    debugger.add("skill:say*:S_FINAL")
    for status in ("S_FINAL", "S_FINAL", "S_RUNNING", "S_FINAL"):
        env.assert_string(f"(skill {status})")
        debugger.run()
        if status == "S_RUNNING":
            assert not stands(debugger)  # the first one only tells how things stand
    assert debugger.stopped.event.status == "S_FINAL"
    assert debugger.stopped.loop == 4


def test_a_condition(env, debugger):
    env.build("(defglobal ?*n* = 0)")
    debugger.add("after:* if (> ?*n* 0)")
    env.assert_string("(one)")
    debugger.run()
    assert not stands(debugger)
    env.eval("(bind ?*n* 1)")
    env.assert_string("(tell a SELECTED)")
    debugger.run()
    assert debugger.stopped.reason == "after rule told"


def test_a_condition_that_fails_stops_and_says_so(env, debugger):
    debugger.add("rule:one if (nothing)")
    env.assert_string("(one)")
    debugger.run()
    assert "breakpoint 1 has a condition that fails" in debugger.stopped.reason
    debugger.remove(1)
    debugger.go_on()
    debugger.run()
    assert has(env, "done")


def test_step_rules_over_the_end_of_a_loop(env, debugger):
    debugger.step("rule")
    env.assert_string("(one)")
    seen = []
    for _ in range(3):
        debugger.run()
        seen.append((debugger.stopped.rule, debugger.stopped.next_rule))
        debugger.step("rule")
    assert seen == [("one", "two"), ("two", "three"), ("three", "")]
    assert debugger.run() == 0  # the end of the loop
    assert not stands(debugger)
    env.assert_string("(tell a SELECTED)")
    debugger.run()
    assert (debugger.stopped.rule, debugger.stopped.loop) == ("told", 2)


def test_a_step_ends_when_the_rules_continue(env, debugger):
    debugger.step("rule")
    debugger.go_on()
    env.assert_string("(one)")
    assert debugger.run() == 3
    assert not stands(debugger)


def test_step_a_transition(env, debugger):
    debugger.step("transition")
    env.assert_string("(tell a SELECTED)")
    env.assert_string("(one)")
    debugger.run()
    assert debugger.stopped.reason == "at goal a (TALK) is SELECTED"
    assert debugger.stopped.breakpoint == 0
    with pytest.raises(ExecutiveError, match="'year' is not a unit of steps"):
        debugger.step("year")


def test_halt_of_the_agent_ends_the_loop_while_rules_are_watched(env, debugger):
    env.build("(defrule stops (declare (salience 10)) (stops) => (halt))")
    debugger.add("rule:never")
    env.assert_string("(one)")
    env.assert_string("(stops)")
    assert debugger.run() == 1
    assert debugger.run() == 3


@pytest.mark.parametrize(
    "actions", ["(halt) (tell-goal g1 FINISHED)", "(tell-goal g1 FINISHED) (halt)"], ids=["before", "after"]
)
def test_halt_beside_a_transition_that_stops_is_not_lost(env, debugger, actions):
    env.build(f"(defrule both (declare (salience 10)) (both) => {actions})")
    debugger.add("goal:g1")
    env.assert_string("(one)")
    env.assert_string("(both)")
    assert debugger.run() == 1
    assert debugger.stopped.rule == "both"
    debugger.go_on()
    assert debugger.run() == 0
    assert not debugger.is_within_loop
    assert debugger.run() == 3


def test_rules_that_go_round_in_circles_end_while_they_are_watched(env, debugger, monkeypatch):
    monkeypatch.setattr("cxbridge.executive.host.endless.MAX_FIRINGS", 50)
    env.build("(defrule circle ?f <- (circle ?n) => (retract ?f) (assert (circle (+ ?n 1))))")
    debugger.add("rule:never")
    env.assert_string("(circle 1)")
    assert debugger.run() == 50
    assert "rules fire endlessly" in env.faults[0]
    assert env.is_ended


def test_a_line_printed_by_two_rules_stays_one(env, debugger):
    lines = []
    env.output.redirect(lambda _level, text: lines.append(text))
    env.build('(defrule say1 (say) => (printout t "a") (assert (say2)))')
    env.build('(defrule say2 (say2) => (printout t "b" crlf))')
    debugger.add("rule:never")
    env.assert_string("(say)")
    debugger.run()
    assert lines == ["ab"]


@pytest.mark.parametrize("text", CRASHING_TEXTS.values(), ids=CRASHING_TEXTS)
def test_a_text_of_a_client_does_not_crash_the_parser(env, text):
    """A fact that was asserted over HTTP ended the daemon."""
    with pytest.raises(ClipsError, match="CLIPS cannot read this text"):
        assert_text(env, text)
    assert env.eval("(+ 1 2)") == 3


def test_an_edit_may_make_a_transition_and_does_not_stop(env, debugger):
    debugger.add("goal:*")
    env.eval("(tell-goal a FINISHED)")
    assert debugger.run() == 0
    assert not stands(debugger)


def test_other_threads_may_use_it(env, debugger):
    debugger.add("before:one")
    env.assert_string("(one)")
    debugger.run()

    def edit_and_go_on():
        with env.lock:
            assert_text(env, "(two)")
        debugger.go_on()

    helper = threading.Thread(target=edit_and_go_on)
    helper.start()
    helper.join(15)
    assert debugger.run() == 3


def test_removing_all_breakpoints_while_stopped_finishes_the_loop(env, debugger):
    debugger.add("before:two")
    env.assert_string("(one)")
    debugger.run()
    debugger.clear()
    debugger.go_on()
    assert debugger.active
    assert debugger.run() == 2
    assert not debugger.active
