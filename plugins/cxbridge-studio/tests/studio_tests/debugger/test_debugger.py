"""The debugger in an environment with a few rules."""

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


def watch_rules(env):
    """Return a list that gets the number and the name of each rule that fires."""
    rules = []
    env.bus.subscribe(lambda event: rules.append((event.number, event.rule)), RuleFired)
    env.watcher.rules.set((), on=True)
    env.watcher.set_hooks()
    return rules


def is_stopped(debugger):
    return debugger.stopped is not None


def has_fact(env, relation):
    return any(True for _ in env.facts(relation))


def test_breakpoint_stops_before_rule(env, debugger):
    rules = watch_rules(env)
    debugger.add("rule:tw*")
    env.assert_string("(one)")
    assert debugger.run() == 1
    stop = debugger.stopped
    assert (stop.kind, stop.reason, stop.breakpoint) == ("before", "before rule two", 1)
    assert (stop.rule, stop.next_rule, stop.fired, stop.loop) == ("one", "two", 1, 1)
    assert debugger.run() == 0  # the rules are stopped
    debugger.go_on()
    assert debugger.run() == 2
    assert not is_stopped(debugger)
    assert rules == [(1, "one"), (2, "two"), (3, "three")]  # numbered like in a run without a stop


def test_breakpoints_stop_after_rule_and_before_next_rule(env, debugger):
    debugger.add("after:one")
    debugger.add("before:two")
    env.assert_string("(one)")
    reasons = []
    while debugger.run() or debugger.stopped:
        if debugger.stopped:
            reasons.append(debugger.stopped.reason)
        debugger.go_on()
    assert reasons == ["after rule one", "before rule two"]


def test_breakpoint_stops_after_rule_of_transition(env, debugger):
    debugger.add("goal:TALK:FINISHED")
    env.assert_string("(tell a SELECTED)")
    debugger.run()
    assert not is_stopped(debugger)
    env.assert_string("(tell b FINISHED)")
    debugger.run()
    stop = debugger.stopped
    assert (stop.kind, stop.reason, stop.rule) == ("transition", "at goal b (TALK) is FINISHED", "told")
    assert (stop.event.goal, stop.next_rule) == ("b", "")


def test_rules_of_agenda_wait_at_transition(env, debugger):
    debugger.add("goal:*")
    env.assert_string("(tell a SELECTED)")
    assert debugger.run() == 1
    assert debugger.stopped.next_rule == "heard"
    assert not has_fact(env, "done")
    debugger.go_on()
    assert debugger.run() == 1
    assert has_fact(env, "done")


def test_breakpoint_stops_at_transition_of_failed_rule(env, debugger):
    env.build(
        "(defrule bad (bad) => (tell-goal x SELECTED) (assert (one)) (str-cat (nth$ 1 (create$ a)) (/ 1 0)))"
    )
    debugger.add("goal:x")
    env.assert_string("(one)")
    env.assert_string("(bad)")
    debugger.run()
    assert debugger.stopped.rule == "bad"


def test_skill_breakpoint_stops_at_changed_status(env, debugger):
    debugger.add("skill:say*:S_FINAL")
    for status in ("S_FINAL", "S_FINAL", "S_RUNNING", "S_FINAL"):
        env.assert_string(f"(skill {status})")
        debugger.run()
        if status == "S_RUNNING":
            assert not is_stopped(debugger)  # the first event has the initial status
    assert debugger.stopped.event.status == "S_FINAL"
    assert debugger.stopped.loop == 4


def test_condition_of_breakpoint_is_evaluated(env, debugger):
    env.build("(defglobal ?*n* = 0)")
    debugger.add("after:* if (> ?*n* 0)")
    env.assert_string("(one)")
    debugger.run()
    assert not is_stopped(debugger)
    env.eval("(bind ?*n* 1)")
    env.assert_string("(tell a SELECTED)")
    debugger.run()
    assert debugger.stopped.reason == "after rule told"


def test_breakpoint_with_failed_condition_stops(env, debugger):
    debugger.add("rule:one if (nothing)")
    env.assert_string("(one)")
    debugger.run()
    assert "breakpoint 1 has a condition that fails" in debugger.stopped.reason
    debugger.remove(1)
    debugger.go_on()
    debugger.run()
    assert has_fact(env, "done")


def test_rule_step_continues_in_next_loop(env, debugger):
    debugger.step("rule")
    env.assert_string("(one)")
    rules = []
    for _ in range(3):
        debugger.run()
        rules.append((debugger.stopped.rule, debugger.stopped.next_rule))
        debugger.step("rule")
    assert rules == [("one", "two"), ("two", "three"), ("three", "")]
    assert debugger.run() == 0  # the end of the loop
    assert not is_stopped(debugger)
    env.assert_string("(tell a SELECTED)")
    debugger.run()
    assert (debugger.stopped.rule, debugger.stopped.loop) == ("told", 2)


def test_continue_ends_step(env, debugger):
    debugger.step("rule")
    debugger.go_on()
    env.assert_string("(one)")
    assert debugger.run() == 3
    assert not is_stopped(debugger)


def test_transition_step_stops_at_next_transition(env, debugger):
    debugger.step("transition")
    env.assert_string("(tell a SELECTED)")
    env.assert_string("(one)")
    debugger.run()
    assert debugger.stopped.reason == "at goal a (TALK) is SELECTED"
    assert debugger.stopped.breakpoint == 0
    with pytest.raises(ExecutiveError, match="'year' is not a unit of steps"):
        debugger.step("year")


def test_halt_ends_debugged_loop(env, debugger):
    env.build("(defrule stops (declare (salience 10)) (stops) => (halt))")
    debugger.add("rule:never")
    env.assert_string("(one)")
    env.assert_string("(stops)")
    assert debugger.run() == 1
    assert debugger.run() == 3


@pytest.mark.parametrize(
    "actions", ["(halt) (tell-goal g1 FINISHED)", "(tell-goal g1 FINISHED) (halt)"], ids=["before", "after"]
)
def test_halt_of_rule_with_transition_ends_loop(env, debugger, actions):
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


def test_endless_rules_end_in_debugger(env, debugger, monkeypatch):
    monkeypatch.setattr("cxbridge.executive.host.endless.MAX_FIRINGS", 50)
    env.build("(defrule circle ?f <- (circle ?n) => (retract ?f) (assert (circle (+ ?n 1))))")
    debugger.add("rule:never")
    env.assert_string("(circle 1)")
    assert debugger.run() == 50
    assert "rules fire endlessly" in env.faults[0]
    assert env.is_ended


def test_line_printed_by_two_rules_is_a_single_line(env, debugger):
    lines = []
    env.output.redirect(lambda _level, text: lines.append(text))
    env.build('(defrule say1 (say) => (printout t "a") (assert (say2)))')
    env.build('(defrule say2 (say2) => (printout t "b" crlf))')
    debugger.add("rule:never")
    env.assert_string("(say)")
    debugger.run()
    assert lines == ["ab"]


@pytest.mark.parametrize("text", CRASHING_TEXTS.values(), ids=CRASHING_TEXTS)
def test_hostile_fact_text_does_not_crash_parser(env, text):
    """Such a fact, asserted over HTTP, ended the daemon."""
    with pytest.raises(ClipsError, match="CLIPS cannot read this text"):
        assert_text(env, text)
    assert env.eval("(+ 1 2)") == 3


def test_transition_between_loops_does_not_stop(env, debugger):
    debugger.add("goal:*")
    env.eval("(tell-goal a FINISHED)")
    assert debugger.run() == 0
    assert not is_stopped(debugger)


def test_second_thread_edits_facts_and_continues(env, debugger):
    debugger.add("before:one")
    env.assert_string("(one)")
    debugger.run()

    def edit_and_continue():
        with env.lock:
            assert_text(env, "(two)")
        debugger.go_on()

    helper = threading.Thread(target=edit_and_continue)
    helper.start()
    helper.join(15)
    assert debugger.run() == 3


def test_loop_ends_after_removal_of_all_breakpoints(env, debugger):
    debugger.add("before:two")
    env.assert_string("(one)")
    debugger.run()
    debugger.clear()
    debugger.go_on()
    assert debugger.is_active
    assert debugger.run() == 2
    assert not debugger.is_active
