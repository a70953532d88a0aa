"""The random placement of machines."""

from __future__ import annotations

from random import Random

import pytest

from cxbridge_rcll.placing import MACHINE_NAMES, Placement, arrange_machines, can_place


@pytest.mark.parametrize("seed", range(50))
def test_each_side_of_machine_is_reachable(seed):
    placed = arrange_machines(Random(seed), MACHINE_NAMES, 7, 8)
    assert placed is not None
    assert sorted(each.machine for each in placed) == sorted(MACHINE_NAMES)
    zones = [each.zone for each in placed]
    assert len(set(zones)) == len(zones)
    for each in placed:
        for x, y in each.side_zones():
            assert 1 <= x <= 7
            assert 1 <= y <= 8
            assert (x, y) not in zones
            assert (x, y) not in {(5, 1), (6, 1), (7, 1)}


def test_equal_seeds_give_equal_fields():
    assert arrange_machines(Random(4), MACHINE_NAMES, 7, 8) == arrange_machines(
        Random(4), MACHINE_NAMES, 7, 8
    )
    assert arrange_machines(Random(4), MACHINE_NAMES, 7, 8) != arrange_machines(
        Random(5), MACHINE_NAMES, 7, 8
    )


def test_too_small_field_has_no_placement():
    assert arrange_machines(Random(0), MACHINE_NAMES, 2, 2) is None


@pytest.mark.parametrize(
    ("new", "placed", "expected"),
    [
        (Placement(1, 3, 4, 0), [], True),
        (Placement(1, 3, 4, 0), [Placement(2, 3, 4, 90)], False),  # the zone has a machine
        (Placement(1, 7, 1, 0), [], False),  # the entry
        (Placement(1, 1, 4, 0), [], False),  # a side points at the wall
        (Placement(7, 1, 4, 0), [], True),  # the side at the wall is unused
        (Placement(1, 3, 4, 0), [Placement(2, 4, 4, 90)], False),  # in front of the machine's side
        (
            Placement(1, 3, 4, 90),
            [Placement(2, 4, 4, 90), Placement(3, 5, 4, 90)],
            False,
        ),  # the third machine in a row
        (Placement(1, 1, 7, 90), [Placement(2, 2, 8, 0)], False),  # closes a corner
        (Placement(1, 3, 4, 45), [Placement(2, 4, 3, 90)], False),  # the zone is on the robot's way
    ],
)
def test_placement_keeps_rules(new, placed, expected):
    assert can_place(new, placed, 7, 8) is expected
