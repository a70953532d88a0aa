"""Scripted skills of a test."""

from __future__ import annotations

from typing import Any

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.skiller.simulation.deciders import Outcome
from cxbridge.skiller.skillstring import SkillStringCall
from cxbridge.skiller.status import Status
from cxbridge.testing.skills import SkillScript


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def skills(clock):
    return SkillScript(clock)


def outcome(skills, name, skiller="Skiller", **args):
    arguments: dict[str | int, Any] = dict(args.items())
    return skills.decider(skiller).decide(SkillStringCall(name, arguments))


def test_unscripted_skill_is_left_to_next_decider(skills):
    assert outcome(skills, "any") is None


def test_steps_of_script_are_used_in_order(skills):
    skills("pick").fails("slipped", after=2.0, times=2).succeeds(after=3.0, times=1)
    found = [outcome(skills, "pick") for _ in range(4)]
    assert found == [*[Outcome(2.0, Status.S_FAILED, "slipped")] * 2, Outcome(3.0), None]


@pytest.mark.parametrize(
    ("args", "matches"),
    [
        ({"thing": "cup"}, True),
        ({"thing": "c*"}, True),
        ({"thing": "cup", "place": "shelf-?"}, True),
        ({"thing": "C*"}, False),
        ({"other": "cup"}, False),
        ({"height": 2}, True),
        ({"height": 3}, False),
        ({"height": "2"}, True),
    ],
)
def test_calls_are_selected_by_arguments(skills, args, matches):
    skills("pick", **args).fails("chosen")
    ended = outcome(skills, "pick", thing="cup", place="shelf-1", height=2)
    assert (ended is not None) == matches


def test_last_matching_script_wins(skills):
    skills("pick").fails("any")
    skills("pick", thing="cup").succeeds(after=7.0)
    assert outcome(skills, "pick", thing="cup") == Outcome(7.0)
    assert outcome(skills, "pick", thing="pot").error == "any"


def test_otherwise_is_for_unscripted_skills(skills):
    skills.otherwise.fails("not expected")
    skills("pick").succeeds()
    assert outcome(skills, "pick") == Outcome(1.0)
    assert outcome(skills, "place").error == "not expected"


def test_function_gets_call(skills, clock):
    skills("wait").does(lambda call: Outcome(call.args["seconds"]))
    clock.sleep_until(clock.now_us() + 2_500_000)
    assert outcome(skills, "wait", "robot1", seconds=4) == Outcome(4)
    (call,) = skills.calls
    assert (call.seconds, call.name, call.args, call.skiller) == (2.5, "wait", {"seconds": 4}, "robot1")


def test_error_names_arguments_of_calls(skills):
    skills("goto", location="hall").succeeds()
    outcome(skills, "goto", place="hall")
    skills.begin("robot1", SkillStringCall("goto", {1: "lab", "speed": 2}))
    outcome(skills, "pick", thing="cup")
    (complaint,) = skills.list_complaints()
    assert " matches no call, calls were goto(place='hall'), goto('lab', speed=2); say " in complaint


def test_effect_happens_with_outcome(skills):
    seen = []
    skills("pick").succeeds(after=2.0, then=lambda: seen.append("picked"))
    skills("place").does(lambda _: None, then=lambda: seen.append("placed"))
    picked = outcome(skills, "pick")
    placed = outcome(skills, "place")
    assert (picked, placed) == (Outcome(2.0), Outcome())
    picked.then()
    placed.then()
    assert seen == ["picked", "placed"]
