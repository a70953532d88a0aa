"""Breakpoints that nothing can ever reach, on an environment of a few rules."""

from __future__ import annotations

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.errors import ExecutiveError
from cxbridge.events import EventBus, GoalTransition, LogLine, PlanActionTransition, SkillStatus
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge_studio.debugger.breakpoints import parse_breakpoint
from cxbridge_studio.debugger.debugger import Debugger
from cxbridge_studio.debugger.names import AgentNames, OccurredNames, read_skill_statuses

AGENT = """
(deftemplate goal (slot class) (slot mode (allowed-values FORMULATED FINISHED))
  (slot outcome (allowed-values UNKNOWN COMPLETED FAILED)))
(deftemplate plan-action (slot state (allowed-values PENDING RUNNING FAILED)))
(defrule say-hello (go) => (assert (gone)))
(defrule say-goodbye (gone) =>)
"""
SKILLS = ("say", "goto", "pick-up")


@pytest.fixture(name="env")
def _env():
    env = ClipsEnvironment("executive", EventBus(VirtualClock()))
    yield env
    env.destroy()


@pytest.fixture(name="load")
def _load(env, tmp_path):
    def load(text, name="agent.clp"):
        file = tmp_path / name
        file.write_text(text)
        assert env.load(file)
        return file

    return load


@pytest.fixture(name="names")
def _names(env, load):
    load(AGENT)
    env.assert_string("(executive-initialized)")
    return AgentNames(env, lambda: SKILLS)


@pytest.mark.parametrize(
    ("spec", "what", "hint"),
    [
        ("rule:say-helo", "there is no rule 'say-helo'", "did you mean say-hello?"),
        ("after:SAY-HELLO", "there is no rule 'SAY-HELLO'", "did you mean say-hello?"),
        ("rule:sya-hell*", "no rule matches 'sya-hell*'", "did you mean say-hello?"),
        ("rule:zebra", "there is no rule 'zebra'", ""),
        ("goal:TALK:FINISHD", "goals have no mode 'FINISHD'", "did you mean FINISHED?"),
        ("goal:TALK:X*", "goals have no mode 'X*'", "the modes are: FORMULATED, FINISHED"),
        ("goal:TALK:FAILED", "goals have no mode 'FAILED'", "FAILED is an outcome: use goal:TALK:*:FAILED"),
        ("goal:TALK::FAILD", "goals have no outcome 'FAILD'", "did you mean FAILED?"),
        ("action:move:RUNING", "plan-actions have no state 'RUNING'", "did you mean RUNNING?"),
        ("skill:sya", "there is no skill 'sya'", "did you mean say?"),
        ("skill:pick{*", "there is no skill 'pick'", "did you mean pick-up?"),
        ("skill:zebra*", "there is no skill 'zebra*'", "there are: goto, pick-up, say"),
        ("skill:say:S_FALED", "skills have no status 'S_FALED'", "did you mean S_FAILED?"),
        ("skill:say{*:FAILED", "skills have no status 'FAILED'", "did you mean S_FAILED?"),
        ("skill:say{*}:s_failed", "skills have no status 's_failed'", "did you mean S_FAILED?"),
    ],
)
def test_mistakes(names, spec, what, hint):
    with pytest.raises(ExecutiveError) as caught:
        names.check(parse_breakpoint(spec))
    assert (caught.value.message, caught.value.hint) == (
        f"breakpoint {spec.replace('::', ':*:')}: {what}",
        hint,
    )


@pytest.mark.parametrize(
    "spec",
    [
        *("rule:say-hello", "rule:say-*", "before:*", "after:[s]ay-goodbye", "rule:**"),
        *("goal:*", "goal:NOBODY", "goal:TALK:FIN*", "goal:TALK:FINISHED:FAILED", "goal:TALK::*"),
        *("action:anything", "action:anything:[PR]*", "action:*:FAILED"),
        *("skill:say", "skill:sa*", "skill:say{*", 'skill:say{text="a:b"}', "skill:*text*:S_FINAL"),
        *("skill:say(*):S_*", "skill:pick-up", "skill:?oto", "skill:say {*"),
    ],
)
def test_no_mistakes(names, spec):
    names.check(parse_breakpoint(spec))


def test_nothing_is_known_of_skills_elsewhere(env, names):
    AgentNames(env).check(parse_breakpoint("skill:zebra"))


def test_all_may_pass_until_the_agent_is_initialised(env, load):
    load(AGENT)
    debugger = Debugger(env)
    told = []
    debugger.names.on_mistakes = lambda mistakes: told.append([str(item) for item, _ in mistakes])
    debugger.add("rule:say-helo")
    debugger.add("rule:say-hello")
    debugger.add("goal:TALK:FINISHD")
    debugger.run()
    assert told == []
    env.assert_string("(executive-initialized)")
    debugger.run()
    debugger.run()
    assert told == [["rule:say-helo", "goal:TALK:FINISHD"]]
    with pytest.raises(ExecutiveError, match="no rule 'say-helo'"):
        debugger.add("rule:say-helo")
    assert len(debugger.breakpoints) == 3
    assert debugger.add("rule:say-helo", checked=False).number == 4


def test_without_anybody_who_listens_the_log_has_the_mistakes(env, load):
    load(AGENT)
    lines = []
    env.bus.subscribe(lambda event: lines.append(event.text), LogLine)
    debugger = Debugger(env)
    debugger.add("rule:say-helo")
    env.assert_string("(executive-initialized)")
    debugger.run()
    assert lines == ["breakpoint rule:say-helo: there is no rule 'say-helo' hint: did you mean say-hello?"]


@pytest.mark.parametrize(
    ("text", "may_load"),
    [
        ('(defrule more (go) => (load* "more.clp"))', True),
        ('(defrule more (go) => (path-load "more.clp"))', True),
        ("(defrule more (file ?f) => (batch* ?f))", True),
        ("(deffunction more (?f) (funcall load* ?f))", True),
        ('(defrule more (go) => (build "(defrule later =>)"))', True),
        ('(defrule more (go) => (path-load "agent.clp"))', False),  # it is loaded
        ('(defrule more (go) => (printout t "(load x)" crlf)) ; (load "more.clp")', False),
    ],
)
def test_a_rule_that_may_be_loaded_later_is_no_mistake(env, load, names, text, may_load):
    lines = []
    env.bus.subscribe(lambda event: lines.append(event.text), LogLine)
    env.build("(deffunction path-load (?file) (load* ?file))")  # the library has it
    file = load(text, "other.clp")
    names = AgentNames(env, is_core_file=lambda path: False)
    if may_load:
        names.check(parse_breakpoint("rule:say-helo"))
        assert lines == ["breakpoint rule:say-helo: there is no rule 'say-helo' yet: did you mean say-hello?"]
    else:
        with pytest.raises(ExecutiveError, match="no rule 'say-helo'"):
            names.check(parse_breakpoint("rule:say-helo"))
    with pytest.raises(ExecutiveError, match="no mode"):  # deftemplates of goals are there
        names.check(parse_breakpoint("goal:TALK:FINISHD"))
    with pytest.raises(ExecutiveError, match="no rule"):  # files of the initialisation load no more
        AgentNames(env, is_core_file=lambda path: path == file).check(parse_breakpoint("rule:say-helo"))


def test_rules_of_all_modules_count(env, names):
    env.build("(defmodule PLANS)")
    env.build("(defrule PLANS::plan-it (x) =>)")
    names.check(parse_breakpoint("rule:plan-it"))
    names.check(parse_breakpoint("rule:say-hello"))


def test_the_statuses_are_those_of_the_interface():
    assert read_skill_statuses() == ("S_INACTIVE", "S_FINAL", "S_RUNNING", "S_FAILED")


def test_names_that_have_occurred():
    met = OccurredNames()
    met.add_event(GoalTransition(0, "executive", "gen1", "TALK", "", "nil", "FORMULATED", "", ""))
    met.add_event(PlanActionTransition(0, "executive", "gen1", "PLAN", "1", "say-hello", "PENDING", ""))
    met.add_event(SkillStatus(0, "executive", "Skiller", 'say{text="x"}', 1, "S_RUNNING"))
    met.add_event(SkillStatus(0, "executive", "Skiller", "", 1, "S_INACTIVE"))
    lacks = [
        met.describe_missing_name(parse_breakpoint(spec))
        for spec in ("goal:TALKK", "goal:T*", "goal:gen1", "action:say-helo", "action:*", "skill:sya{*}")
    ]
    assert lacks == [
        "there was no goal 'TALKK' (did you mean TALK?)",
        "",
        "",
        "there was no action 'say-helo' (did you mean say-hello?)",
        "",
        "there was no skill 'sya' (did you mean say?)",
    ]
    assert met.describe_missing_name(parse_breakpoint("rule:x")) == ""


def test_a_skill_without_arguments_stands_for_all_of_them():
    event = SkillStatus(0, "executive", "Skiller", 'say{text="x"}', 1, "S_FINAL")
    for spec in ("skill:say", "skill:s?y:S_FINAL", "skill:say{*", "skill:*"):
        assert parse_breakpoint(spec).matches_transition(event), spec
    for spec in ("skill:sa", "skill:say{}", "skill:say:S_FAILED"):
        assert not parse_breakpoint(spec).matches_transition(event), spec
