"""The shipped skills: their success and their failures."""

from __future__ import annotations

from typing import Any

import pytest

from cxbridge.events import Level
from tests.skiller.lua.hardware import Navigator, run
from tests.skiller.rig import Rig

MOBILE = ("say", "wait", "fail", "goto_place", "goto_waypoints", "pick", "place")


@pytest.fixture
def rig() -> Rig:
    rig = Rig()
    rig.lua(space="mobile")
    return rig


def outcome(rig: Rig) -> tuple[str, str]:
    return rig.status, rig.state.error


@pytest.mark.parametrize(
    ("space", "skills"), [("mobile", MOBILE), ("test", ("say", "wait", "fail", "moveto", "relmoveto"))]
)
def test_space_has_documented_skills(space: str, skills: tuple[str, ...]):
    skiller = Rig().lua(space=space)
    assert skiller.skills == skills
    for skill in skills:
        text = skiller.engine.documentation(skill)
        assert text
        assert f"{skill}{{" in text  # an example
        assert "@param" in text


# -- fail


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("fail{}", "on purpose"),
        ('fail{after=0.2, error="out of paint"}', "out of paint"),
        ("fail{prob=0}", ""),
        ("fail{after=-1}", "after must be a number from 0, and prob a number from 0 to 1"),
        ('fail{after="soon"}', "after must be a number from 0, and prob a number from 0 to 1"),
        ('goto_place{place="wp1"}', "there is no navigator"),
        ("pick{}", "there is no gripper"),
        ("place{}", "there is no gripper"),
    ],
)
def test_skills_end_without_hardware(rig: Rig, text: str, error: str):
    run(rig, text)
    assert outcome(rig) == ("S_FAILED" if error else "S_FINAL", error)


# -- goto_place and goto_waypoints


def test_goto_place_arrives(rig: Rig):
    navigator = Navigator(rig)
    run(rig, 'goto_place{place="wp1"}')
    assert outcome(rig) == ("S_FINAL", "")
    run(rig, 'goto_place{place="wp2", ori=0.5}')
    run(rig, 'goto_place("wp3")')
    assert outcome(rig) == ("S_FINAL", "")
    assert navigator.orders == [("PlaceGoto", "wp1"), ("PlaceWithOriGoto", "wp2", 0.5), ("PlaceGoto", "wp3")]


@pytest.mark.parametrize(
    ("code", "error"),
    [
        (1, "the motor does not answer"), (2, "the way is obstructed"), (8, "there is no path"),
        (4, "the navigator does not know the place"), (3, "error 3 of the navigator"),
    ],
)  # fmt: skip
def test_goto_place_fails_with_error_of_navigator(rig: Rig, code: int, error: str):
    Navigator(rig, errors=(code,))
    run(rig, 'goto_place{place="wp1"}')
    assert outcome(rig) == ("S_FAILED", error)


@pytest.mark.parametrize(
    ("text", "error"),
    [("goto_place{place=5}", "no place given"), ("goto_waypoints{places={}}", "no places given")],
)
def test_goto_needs_places(rig: Rig, text: str, error: str):
    Navigator(rig)
    run(rig, text)
    assert outcome(rig) == ("S_FAILED", error)


def test_goto_place_fails_without_answer_of_navigator(rig: Rig):
    rig.backends.remove(Navigator(rig))
    assert run(rig, 'goto_place{place="wp1"}') > 30
    assert outcome(rig) == ("S_FAILED", "the navigator does not answer")


def test_goto_place_fails_after_order_of_another_client(rig: Rig):
    navigator = Navigator(rig, loops=50)
    rig.exec('goto_place{place="wp1"}', loops=5)
    navigator.interface.msgid = 77
    navigator.interface.write()
    rig.loop()
    assert outcome(rig) == ("S_FAILED", "somebody else drives the robot")
    rig.loop()
    assert navigator.orders == [("PlaceGoto", "wp1")]  # the skill does not stop the order of the other client


def test_late_goto_place_stops_robot(rig: Rig):
    navigator = Navigator(rig, loops=500)
    run(rig, 'goto_place{place="wp1", patience=2}')
    assert outcome(rig) == ("S_FAILED", "it takes too long")
    rig.loop()
    assert [order[0] for order in navigator.orders] == ["PlaceGoto", "Stop"]


def test_stopped_goto_place_stops_robot(rig: Rig):
    navigator = Navigator(rig, loops=500)
    rig.exec('goto_place{place="wp1"}', loops=5)
    rig.send("StopExec")
    rig.loop(2)
    assert [order[0] for order in navigator.orders] == ["PlaceGoto", "Stop"]
    assert rig.status == "S_INACTIVE"


def test_goto_place_fails_after_end_of_navigator(rig: Rig):
    navigator = Navigator(rig, loops=500)
    rig.exec('goto_place{place="wp1"}', loops=5)
    rig.board.close(navigator.interface)
    rig.backends.remove(navigator)
    rig.loop()
    assert outcome(rig) == ("S_FAILED", "the navigator is gone")


def test_goto_place_ignores_earlier_order_with_same_id(rig: Rig):
    """The order of another client with the same id had ended before."""
    navigator = Navigator(rig)
    navigator.interface.msgid = 1
    navigator.interface.write()
    assert run(rig, 'goto_place{place="wp1"}') > 3
    assert outcome(rig) == ("S_FINAL", "")


def test_goto_place_is_final_when_navigator_forgets_id(rig: Rig):
    navigator = Navigator(rig, loops=50)
    rig.exec('goto_place{place="wp1"}', loops=5)
    navigator.interface.msgid, navigator.interface.final = 0, True
    navigator.interface.write()
    rig.loop()
    assert outcome(rig) == ("S_FINAL", "")


def test_goto_waypoints_visits_all_places(rig: Rig):
    navigator = Navigator(rig)
    run(rig, 'goto_waypoints{places={"wp1", "wp2", "wp-final"}}')
    assert outcome(rig) == ("S_FINAL", "")
    assert [order[1] for order in navigator.orders] == ["wp1", "wp2", "wp-final"]


def test_goto_waypoints_fails_at_first_unreached_place(rig: Rig):
    navigator = Navigator(rig, errors=(0, 2))
    run(rig, 'goto_waypoints{places={"wp1", "wp2", "wp-final"}}')
    assert outcome(rig) == ("S_FAILED", "wp2: the way is obstructed")
    assert [order[1] for order in navigator.orders] == ["wp1", "wp2"]


# -- pick and place


class Hand:
    """A gripper that obeys after two loops, unless it is stuck."""

    def __init__(self, rig: Rig, *, closed: bool = False, stuck: bool = False) -> None:
        board: Any = rig.board
        self.interface = board.open_for_writing("GripperInterface", "Gripper", owner="test")
        self.interface.gripper_state = "CLOSED" if closed else "OPEN"
        self.interface.write()
        self._stuck = stuck
        self._next: list[str] = []
        rig.add(self)

    def loop(self) -> None:
        if self._next and not self._stuck:
            self.interface.gripper_state = self._next.pop()
            self.interface.write()
        while (message := self.interface.msgq_first()) is not None:
            self._next = ["CLOSED" if message.type == "CloseGripperMessage" else "OPEN"]
            self.interface.msgq_pop()


def test_pick_closes_and_place_opens_gripper(rig: Rig):
    hand = Hand(rig)
    run(rig, 'pick{what="cup"}')
    assert (outcome(rig), hand.interface.gripper_state.name) == (("S_FINAL", ""), "CLOSED")
    assert "pick cup" in rig.logged(Level.INFO)
    run(rig, "place{}")
    assert (outcome(rig), hand.interface.gripper_state.name) == (("S_FINAL", ""), "OPEN")


@pytest.mark.parametrize(("skill", "state"), [("pick", "closed"), ("place", "open")])
def test_pick_and_place_fail_in_final_state_of_gripper(rig: Rig, skill: str, state: str):
    Hand(rig, closed=state == "closed")
    run(rig, f"{skill}{{}}")
    assert outcome(rig) == ("S_FAILED", f"the gripper is {state} already")


@pytest.mark.parametrize(("skill", "verb"), [("pick", "close"), ("place", "open")])
def test_pick_and_place_fail_with_stuck_gripper(rig: Rig, skill: str, verb: str):
    Hand(rig, closed=skill == "place", stuck=True)
    assert run(rig, f"{skill}{{patience=0.5}}") < 20
    assert outcome(rig) == ("S_FAILED", f"the gripper does not {verb}")
