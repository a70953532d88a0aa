"""A game as the messages of a referee elsewhere tell it."""

from __future__ import annotations

import pytest

from cxbridge_explore.game.score import Award, Delivery, ProductOrder
from cxbridge_rcll.field import Field
from cxbridge_rcll.machines import BeltPosition, Workpiece
from cxbridge_rcll.reported_game import ReportedGame
from rcll_tests.referee_box import game_state, machine_info, message_types, order_info


@pytest.fixture(scope="module")
def types(tmp_path_factory):
    return message_types(tmp_path_factory.mktemp("messages"))


@pytest.fixture
def paid():
    return []


@pytest.fixture
def game(paid):
    return ReportedGame(paid.append)


def test_points_are_counted_as_they_come(types, game):
    for cyan, magenta, seconds in ((0, 0, 1.0), (2, 0, 5.5), (2, 3, 7.0), (0, 3, 9.25)):
        game.handle_message(game_state(types, "PRODUCTION", seconds, cyan, magenta))
    assert game.score.points == {"CYAN": 0, "MAGENTA": 3}
    assert game.score.awards == (
        Award("CYAN", 2, 5.5, "PRODUCTION", "", "unknown"),
        Award("MAGENTA", 3, 7.0, "PRODUCTION", "", "unknown"),
        Award("CYAN", -2, 9.25, "PRODUCTION", "", "unknown"),
    )
    assert game.score.phase == "PRODUCTION"
    assert game.score.game_time == 9.25


def test_a_delivery_is_counted_once(types, game):
    game.handle_message(game_state(types, "PRODUCTION", 30.0))
    for count in (0, 1, 1, 2):
        game.handle_message(order_info(types, count))
    assert game.score.deliveries == (Delivery(7, "C1", "CYAN", 30.0),) * 2
    assert game.score.orders == (ProductOrder(7, "C1", 30, 90),)


def test_the_states_of_machines_are_seen(types, game):
    game.handle_message(game_state(types, "PRODUCTION", 1.0))
    game.handle_message(machine_info(types, state="PROCESSING"))
    assert game.state == ("PRODUCTION", {"C-BS": "PROCESSING"})


def test_a_game_is_over_when_the_referee_has_said_it_twice(types, game):
    said = []
    for phase in ("PRE_GAME", "PRODUCTION", "POST_GAME", "POST_GAME"):
        game.handle_message(game_state(types, phase, 0.0))
        said.append(game.is_over)
    assert said == [False, False, False, True]


def test_a_machine_is_where_the_referee_says(types, game):
    game.handle_message(machine_info(types))
    pose = Field(game.machine_facts).find_pose("C-BS-O")
    assert pose is not None
    assert (round(pose.x, 2), round(pose.y, 2)) == (3.5, 0.75)


@pytest.mark.parametrize(
    ("kind", "place", "is_there"),
    [
        ("BS", BeltPosition.OUTPUT, True),
        ("BS", BeltPosition.INPUT, True),
        ("CS", BeltPosition.OUTPUT, True),
        ("CS", BeltPosition.INPUT, False),
    ],
)
def test_what_was_made_is_taken_once(types, game, kind, place, is_there):
    for state in ("IDLE", "PROCESSING", "READY-AT-OUTPUT", "IDLE"):
        game.handle_message(machine_info(types, "C-X", kind, state))
    machine = game.machines["C-X"]
    assert machine.has_workpiece(place) is is_there
    assert (machine.take_workpiece(place) is not None) is is_there
    assert machine.take_workpiece(place) is None
    game.handle_message(machine_info(types, "C-X", kind, "READY-AT-OUTPUT"))
    assert machine.has_workpiece(place) is is_there


def test_a_payment_is_told_to_the_referee(types, game, paid):
    game.handle_message(machine_info(types, "C-RS1", "RS"))
    machine = game.machines["C-RS1"]
    machine.pay_base()
    machine.put_workpiece(Workpiece(["BASE_RED"]))
    assert paid == ["C-RS1"]
    assert not machine.has_workpiece(BeltPosition.OUTPUT)


def test_other_messages_are_ignored(types, game):
    game.handle_message(types.create("llsf_msgs.SetTeamName"))
    assert game.score.phase == ""
