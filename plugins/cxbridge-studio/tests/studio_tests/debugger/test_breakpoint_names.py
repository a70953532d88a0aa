"""Breakpoints with names that the agent does not have."""

from __future__ import annotations

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.errors import ExecutiveError
from cxbridge.events import EventBus
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge_studio.debugger.breakpoint_checker import BreakpointChecker
from cxbridge_studio.debugger.breakpoints import parse_breakpoint
from cxbridge_studio.debugger.debugger import Debugger

AGENT = """
(deftemplate goal (slot class) (slot mode (allowed-values FORMULATED FINISHED))
  (slot outcome (allowed-values UNKNOWN COMPLETED FAILED)))
(deftemplate plan-action (slot state (allowed-values PENDING RUNNING FAILED)))
(defrule say-hello (go) => (assert (gone)))
(defrule say-goodbye (gone) =>)
"""
SKILLS = ("say", "goto", "pick-up")


@pytest.fixture(name="env")
def _env(tmp_path):
    env = ClipsEnvironment("executive", EventBus(VirtualClock()))
    file = tmp_path / "agent.clp"
    file.write_text(AGENT)
    assert env.load(file)
    yield env
    env.destroy()


@pytest.fixture(name="names")
def _names(env):
    env.assert_string("(executive-initialized)")
    return BreakpointChecker(env, lambda: SKILLS)


@pytest.mark.parametrize(
    ("spec", "message", "hint"),
    [
        ("rule:say-helo", "there is no rule 'say-helo'", "did you mean say-hello?"),
        ("after:SAY-HELLO", "there is no rule 'SAY-HELLO'", "did you mean say-hello?"),
        ("rule:sya-hell*", "no rule matches 'sya-hell*'", "did you mean say-hello?"),
        ("goal:TALK:FINISHD", "goals have no mode 'FINISHD'", "did you mean FINISHED?"),
        ("goal:TALK:X*", "goals have no mode 'X*'", "the modes are: FORMULATED, FINISHED"),
        ("goal:TALK:FAILED", "goals have no mode 'FAILED'", "FAILED is an outcome: use goal:TALK:*:FAILED"),
        ("goal:TALK::FAILD", "goals have no outcome 'FAILD'", "did you mean FAILED?"),
        ("action:move:RUNING", "plan-actions have no state 'RUNING'", "did you mean RUNNING?"),
        ("skill:sya", "there is no skill 'sya'", "did you mean say?"),
        ("skill:zebra*", "there is no skill 'zebra*'", "there are: goto, pick-up, say"),
        ("skill:say:S_FALED", "skills have no status 'S_FALED'", "did you mean S_FAILED?"),
        ("skill:say{*}:s_failed", "skills have no status 's_failed'", "did you mean S_FAILED?"),
    ],
)
def test_unknown_name_is_an_error_with_hint(names, spec, message, hint):
    with pytest.raises(ExecutiveError) as caught:
        names.check(parse_breakpoint(spec))
    assert (caught.value.message, caught.value.hint) == (
        f"breakpoint {spec.replace('::', ':*:')}: {message}",
        hint,
    )


@pytest.mark.parametrize(
    "spec",
    [
        *("rule:say-hello", "rule:say-*", "before:*", "after:[s]ay-goodbye", "rule:**"),
        *("goal:*", "goal:UNKNOWN", "goal:TALK:FIN*", "goal:TALK:FINISHED:FAILED", "goal:TALK::*"),
        *("action:anything", "action:anything:[PR]*", "action:*:FAILED"),
        *("skill:say", "skill:sa*", "skill:say{*", 'skill:say{text="a:b"}', "skill:*text*:S_FINAL"),
        *("skill:say(*):S_*", "skill:pick-up", "skill:?oto", "skill:say {*"),
    ],
)
def test_possible_name_is_accepted(names, spec):
    names.check(parse_breakpoint(spec))


def test_skill_names_are_not_checked_without_skills(env, names):
    BreakpointChecker(env).check(parse_breakpoint("skill:zebra"))


def test_names_are_checked_after_initialisation_of_agent(env):
    debugger = Debugger(env)
    reports = []
    debugger.breakpoint_checker.on_mistakes = lambda mistakes: reports.append(
        [str(item) for item, _ in mistakes]
    )
    debugger.add("rule:say-helo")
    debugger.add("rule:say-hello")
    debugger.add("goal:TALK:FINISHD")
    debugger.run()
    assert reports == []
    env.assert_string("(executive-initialized)")
    debugger.run()
    debugger.run()
    assert reports == [["rule:say-helo", "goal:TALK:FINISHD"]]
    with pytest.raises(ExecutiveError, match="no rule 'say-helo'"):
        debugger.add("rule:say-helo")
    assert len(debugger.breakpoints) == 3
    assert debugger.add("rule:say-helo", checked=False).number == 4


def test_rules_of_all_modules_are_known(env, names):
    env.build("(defmodule PLANS)")
    env.build("(defrule PLANS::plan-it (x) =>)")
    names.check(parse_breakpoint("rule:plan-it"))
    names.check(parse_breakpoint("rule:say-hello"))
