"""A run that a test drives, through the fixture that tests have."""

from __future__ import annotations

import pytest

from cxbridge.errors import CxbridgeError
from tests.run.mini import AGENT, write_scenario


@pytest.fixture
def mini(tmp_path):
    return write_scenario(tmp_path / "mini", mapping="act: work{what=?(text)s}")


def test_clock_stands_until_step_or_advance(cx, mini):
    run = cx.run(mini)
    assert run.seconds == 0.0
    run.step()
    assert run.seconds == pytest.approx(0.033333)
    run.advance(1.0)
    assert 1.0 <= run.seconds < 1.1


def test_successful_skill_completes_goal(cx, mini):
    run = cx.run(mini)
    run.skills("work").succeeds(after=5.0)
    run.to_end()
    goal = run.goal("MINI")
    assert (goal.id, goal.mode, goal.outcome) == ("G", "RETRACTED", "COMPLETED")
    assert goal.modes == [
        *("FORMULATED", "SELECTED", "EXPANDED", "COMMITTED", "DISPATCHED", "FINISHED", "EVALUATED"),
        "RETRACTED",
    ]
    assert [call.args for call in run.skills.calls] == [{"what": "hello"}]
    assert run.actions("act")[0].states[-1] == "FINAL"
    assert 5.0 < goal.history[-1][0] < 5.3
    run.assert_outcomes(MINI="COMPLETED")


def test_quit_with_open_goals_fails_to_end(cx, tmp_path):
    bye = "(defrule bye (goal (id G) (mode DISPATCHED)) => (quit))"
    run = cx.run(write_scenario(tmp_path / "bye", mapping="act: work{what=?(text)s}", agent=AGENT + bye))
    with pytest.raises(AssertionError, match="the agent quit before its root goals were over"):
        run.to_end()


def test_failed_skill_fails_goal(cx, mini):
    run = cx.run(mini)
    run.skills("work", what="hel*").fails("too heavy")
    run.to_end()
    run.assert_outcomes(MINI="FAILED")
    assert any("too heavy" in line.text for line in run.log)
    with pytest.raises(AssertionError, match=r"MINI should be COMPLETED: G is RETRACTED FAILED"):
        run.assert_outcomes(MINI="COMPLETED")


def test_hanging_skill_fails_test_after_virtual_timeout(cx, mini):
    run = cx.run(mini)
    run.skills("work").hangs()
    with pytest.raises(AssertionError, match=r"not over within 100 s .*\n.*G \(MINI\): DISPATCHED"):
        run.to_end(timeout=100)
    assert 100 <= run.seconds < 100.1


def test_callbacks_run_at_their_times(cx, mini):
    run = cx.run(mini)
    seen = []
    run.at(0.5, lambda: seen.append(run.seconds))
    run.at(0.2, lambda: seen.append(run.seconds))
    run.advance(1.0)
    assert [round(when, 1) for when in seen] == [0.2, 0.5]


def test_facts_are_read_asserted_and_retracted(cx, mini):
    run = cx.run(mini)
    run.skills("work").hangs()
    run.advance(1.0)
    assert run.fact("plan_action", action_name="act")["param-values"] == ("hello",)
    run.assert_fact("(domain-object (name a-cup) (type cup))")
    assert [len(run.facts("domain-object", type=name)) for name in ("cup", "cat")] == [1, 0]
    assert run.retract("domain-object", name="a-cup") == 1
    assert run.facts("domain-object", type="cup") == []
    with pytest.raises(AssertionError, match="0 facts match"):
        run.fact("domain-object", name="a-cup")
    run.assert_fact("(domain-object (name x) (type y))")
    with pytest.raises(AssertionError, match="has no slot 'colour'; it has: "):
        run.facts("domain-object", colour="red")
    with pytest.raises(AssertionError, match="there is no deftemplate 'nothing'"):
        run.facts("nothing")
    for text, reason in (
        ("(domain-object (name x)", "Syntax Error"),
        ("(domain-object (colour red))", "Invalid slot 'colour' not defined"),
        ("", "Syntax Error"),
    ):
        with pytest.raises(AssertionError, match=f"cannot be asserted: .*{reason}"):
            run.assert_fact(text)


def test_invalid_arguments_are_refused_at_once(cx, mini):
    run = cx.run(mini)
    work = run.skills("work").optional()
    for wrong in (
        lambda: run.step(-3),
        lambda: run.at(-1, print),
        lambda: run.advance("3"),
        lambda: work.fails(times="3"),
        lambda: work.succeeds(after="a"),
        lambda: work.succeeds(after=-1),
    ):
        with pytest.raises(ValueError, match="must be a number of at least"):
            wrong()
    with pytest.raises(TypeError, match="a function of the call"):
        work.does(3)
    with pytest.raises(AssertionError, match="there is no action 'atc'"):
        run.actions("atc")
    with pytest.raises(CxbridgeError, match="order: 'foo' is not one of total, partial"):
        run.assert_golden(order="foo")
    with pytest.raises(CxbridgeError, match="scripted"):
        cx.run(mini, skiller="foo")


def test_interfaces_are_read_written_and_get_messages(cx, mini):
    run = cx.run(mini)
    run.write("BatteryInterface::Robot", current=3, absolute_soc=0.5)
    assert run.read("BatteryInterface::Robot")["current"] == 3
    run.skills("work").hangs()
    run.advance(1.0)
    assert run.read("SkillerInterface::Skiller")["status"].name == "S_RUNNING"
    with pytest.raises(CxbridgeError, match="nothing"):
        run.write("BatteryInterface::Robot", nothing=1)
    with pytest.raises(CxbridgeError, match="No writing instance"):
        run.send("SwitchInterface::Lamp", "EnableSwitch")


def has_skiller(run):
    (info,) = run.assembly.board.list("SkillerInterface")
    return info.has_writer


def test_skiller_vanishes_and_returns(cx, mini):
    run = cx.run(mini)
    run.skills("work").succeeds(after=3.0)
    run.at(1.0, run.skills.vanish)
    run.advance(2.0)
    assert run.goal("MINI").error == "ACTION-FAILED"
    assert not has_skiller(run)
    with pytest.raises(AssertionError, match="there is no Skiller 'Skiller'"):
        run.skills.vanish()
    run.skills.come_back()
    assert has_skiller(run)
    with pytest.raises(AssertionError, match="there is no Skiller 'other'; there are: Skiller"):
        run.skills.come_back("other")


def test_stolen_control_fails_goal(cx, mini):
    run = cx.run(mini)
    run.skills("work").hangs()
    run.advance(1.0)
    ours = run.read("SkillerInterface::Skiller")["exclusive_controller"]
    run.skills.take_control()
    run.step()
    assert run.read("SkillerInterface::Skiller")["exclusive_controller"] not in ("", ours)


def test_error_in_rule_fails_test(cx, tmp_path):
    agent = AGENT + "(defrule bad (begun) => (div 1 0))"
    run = cx.run(write_scenario(tmp_path, agent=agent), strict=False)
    with pytest.raises(AssertionError, match=r"an error in a rule: .*div"):
        run.advance(1.0)


def test_broken_construct_fails_test(cx, tmp_path):
    with pytest.raises(
        AssertionError, match=r"mini.clp:\d+:(?s:.*)1 mistake, the agent was not started; strict=False"
    ):
        cx.run(write_scenario(tmp_path, agent=AGENT + "(defrule broken (nothing-such) => (no-function))"))


def test_endless_rules_fail_test(cx, tmp_path):
    agent = AGENT + "(defrule circle ?f <- (circle ?n) => (retract ?f) (assert (circle (+ ?n 1))))"
    agent += "(defrule circle-begin (begun) => (assert (circle 0)))"
    run = cx.run(write_scenario(tmp_path, agent=agent))
    with pytest.raises(AssertionError, match=r"an error in a rule: rules fire endlessly: circle "):
        run.advance(1.0)


def test_endless_rule_fails_test(cx, tmp_path):
    agent = AGENT + "(defrule stuck (begun) => (while TRUE (bind ?x 1)))"
    with pytest.raises(AssertionError, match=r"no end within 0.5 s of real time; last rules: .*stuck"):
        cx.run(write_scenario(tmp_path, agent=agent), patience=0.5).advance(1.0)


def test_real_skills_cannot_be_scripted(cx):
    run = cx.run("test-scenario", skiller="lua")
    with pytest.raises(AssertionError, match="executed by 'lua'"):
        run.skills("say").succeeds()
    run.to_end()
    assert run.goal("TALK").outcome == "COMPLETED"
