"""Random positions of the machines in one half of the field, such that robots reach each machine.

The rules of the league and its referee box: no machine in or next to the entry zone, no side towards a wall,
free zones before the sides, never three in a row, no closed corner.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from random import Random
from typing import Final

ANGLES: Final = tuple(range(0, 360, 45))
# The step to the next zone in the direction of each angle.
_AHEAD: Final = ((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1))

DELIVERY: Final = 7  # the machine that robots use from one side only

# The names of the machines by their numbers in the referee's rules.
NAMES: Final = {1: "BS", 2: "CS1", 3: "CS2", 4: "RS1", 5: "RS2", 6: "SS", DELIVERY: "DS"}

_MAX_TRIES: Final = 10_000  # attempts before an arrangement counts as impossible
_CANDIDATES: Final = 40  # random poses of a machine before an attempt counts as a dead end


@dataclass(frozen=True, slots=True)
class Placement:
    """The position of a machine.

    :param machine: the number of the machine.
    :param x: the column of its zone, from 1.
    :param y: the row of its zone, from 1.
    :param angle: the direction of its first side in degrees.
    """

    machine: int
    x: int
    y: int
    angle: int

    @property
    def zone(self) -> tuple[int, int]:
        """The zone of the machine."""
        return self.x, self.y

    def sides(self) -> Iterator[tuple[int, int]]:
        """Yield the zones before the machine's sides, which robots need."""
        turns = (self.angle,) if self.machine == DELIVERY else (self.angle, self.angle + 180)
        for turn in turns:
            index = turn // 45 % len(_AHEAD)
            step_x, step_y = _AHEAD[index]
            yield self.x + step_x, self.y + step_y
            if index % 2:  # a robot reaches a diagonal zone through the two adjacent ones
                yield self.x + step_x, self.y
                yield self.x, self.y + step_y


def arrange(random: Random, machines: Collection[int], width: int, height: int) -> list[Placement] | None:
    """Return random positions of machines; None if no arrangement fits.

    :param width: the width of the half in zones.
    :param height: the height of the half in zones.
    """
    zones = [(x, y) for x in range(1, width + 1) for y in range(1, height + 1)]
    # Machines are placed one after another, which may run into a dead end: the next attempt starts again.
    for _ in range(_MAX_TRIES):
        placements: list[Placement] = []
        for machine in sorted(machines):
            candidates = [
                Placement(machine, *random.choice(zones), random.choice(ANGLES)) for _ in range(_CANDIDATES)
            ]
            fitting = (placement for placement in candidates if fits(placement, placements, width, height))
            chosen = next(fitting, None)
            if chosen is None:
                break
            placements.append(chosen)
        else:
            return placements
    return None


def fits(candidate: Placement, placements: Collection[Placement], width: int, height: int) -> bool:
    """Return whether a machine fits among the placed ones."""
    zones = {placement.zone for placement in placements} | {candidate.zone}
    if len(zones) != len(placements) + 1 or candidate.zone in _entrance(width):
        return False
    sides = set(candidate.sides())
    if any(not (1 <= x <= width and 1 <= y <= height) for x, y in sides) or sides & _insertion_zones(width):
        return False
    for placement in placements:
        other_sides = set(placement.sides())
        if candidate.zone in other_sides or placement.zone in sides or other_sides & sides:
            return False
    return not _has_row_of_three(zones) and not _closes_corner(zones, width, height)


def _entrance(width: int) -> set[tuple[int, int]]:
    """Return the zones of the robots' entrance and the zone before them."""
    return _insertion_zones(width) | {(width - 2, 2)}


def _insertion_zones(width: int) -> set[tuple[int, int]]:
    """Return the zones of the robots' entrance."""
    return {(width, 1), (width - 1, 1), (width - 2, 1)}


def _has_row_of_three(zones: set[tuple[int, int]]) -> bool:
    """Return whether three machines are in a row."""
    return any(
        (x + step_x, y + step_y) in zones and (x + 2 * step_x, y + 2 * step_y) in zones
        for x, y in zones
        for step_x, step_y in _AHEAD[:4]  # the other four directions are their opposites
    )


def _closes_corner(zones: set[tuple[int, int]], width: int, height: int) -> bool:
    """Return whether two machines block both ways to a corner."""
    corners = (((2, 1), (1, 2)), ((2, height), (1, height - 1)), ((width - 1, height), (width, height - 1)))
    return any(set(pair) <= zones for pair in corners)
