"""Fields that are drawn: robots reach each machine."""

from __future__ import annotations

from random import Random

import pytest

from cxbridge_rcll.placing import MACHINE_NAMES, Placement, arrange_machines, can_place


@pytest.mark.parametrize("seed", range(50))
def test_each_machine_can_be_reached(seed):
    placed = arrange_machines(Random(seed), MACHINE_NAMES, 7, 8)
    assert placed is not None
    assert sorted(each.machine for each in placed) == sorted(MACHINE_NAMES)
    taken = [each.zone for each in placed]
    assert len(set(taken)) == len(taken)
    for each in placed:
        for x, y in each.side_zones():
            assert 1 <= x <= 7
            assert 1 <= y <= 8
            assert (x, y) not in taken
            assert (x, y) not in {(5, 1), (6, 1), (7, 1)}


def test_a_seed_draws_one_field():
    assert arrange_machines(Random(4), MACHINE_NAMES, 7, 8) == arrange_machines(
        Random(4), MACHINE_NAMES, 7, 8
    )
    assert arrange_machines(Random(4), MACHINE_NAMES, 7, 8) != arrange_machines(
        Random(5), MACHINE_NAMES, 7, 8
    )


def test_a_field_without_room_has_none():
    assert arrange_machines(Random(0), MACHINE_NAMES, 2, 2) is None


@pytest.mark.parametrize(
    ("new", "others", "may"),
    [
        (Placement(1, 3, 4, 0), [], True),
        (Placement(1, 3, 4, 0), [Placement(2, 3, 4, 90)], False),  # taken
        (Placement(1, 7, 1, 0), [], False),  # the entry
        (Placement(1, 1, 4, 0), [], False),  # a side points at the wall
        (Placement(7, 1, 4, 0), [], True),  # its other side is not used
        (Placement(1, 3, 4, 0), [Placement(2, 4, 4, 90)], False),  # before its side
        (
            Placement(1, 3, 4, 90),
            [Placement(2, 4, 4, 90), Placement(3, 5, 4, 90)],
            False,
        ),  # the third in a row
        (Placement(1, 1, 7, 90), [Placement(2, 2, 8, 0)], False),  # closes a corner
        (Placement(1, 3, 4, 45), [Placement(2, 4, 3, 90)], False),  # a robot comes over that zone
    ],
)
def test_the_rules(new, others, may):
    assert can_place(new, others, 7, 8) is may
