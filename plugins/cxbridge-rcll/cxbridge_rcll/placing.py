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

DELIVERY: Final = 7  # machine with only one used side

# Machines by their numbers in the referee's rules.
NAMES: Final = {1: "BS", 2: "CS1", 3: "CS2", 4: "RS1", 5: "RS2", 6: "SS", DELIVERY: "DS"}

_TRIES: Final = 10_000  # attempts before the arrangement counts as impossible


@dataclass(frozen=True, slots=True)
class Placed:
    """The position of a machine.

    :param x: zone, from 1.
    :param y: zone, from 1.
    :param angle: degrees.
    """

    machine: int
    x: int
    y: int
    angle: int

    @property
    def zone(self) -> tuple[int, int]:
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


def place(random: Random, machines: Collection[int], width: int, height: int) -> list[Placed] | None:
    """Return random positions of machines; None if no arrangement fits.

    :param width: the width of the half in zones.
    :param height: the height of the half in zones.
    """
    zones = [(x, y) for x in range(1, width + 1) for y in range(1, height + 1)]
    # greedy placement can run into a dead end: start again
    for _ in range(_TRIES):
        placed: list[Placed] = []
        for machine in sorted(machines):
            candidates = [Placed(machine, *random.choice(zones), random.choice(ANGLES)) for _ in range(40)]
            position = next((each for each in candidates if fits(each, placed, width, height)), None)
            if position is None:
                break
            placed.append(position)
        else:
            return placed
    return None


def fits(new: Placed, placed: Collection[Placed], width: int, height: int) -> bool:
    """Return whether a machine fits among the placed ones."""
    taken = {each.zone for each in placed} | {new.zone}
    if len(taken) != len(placed) + 1 or new.zone in _entry(width):
        return False
    free = set(new.sides())
    if any(not (1 <= x <= width and 1 <= y <= height) for x, y in free) or free & _gate(width):
        return False
    for each in placed:
        sides = set(each.sides())
        if new.zone in sides or each.zone in free or sides & free:
            return False
    return not _is_third(taken) and not _closes_a_corner(taken, width, height)


def _entry(width: int) -> set[tuple[int, int]]:
    """Return the zones of the robots' entrance and the zone before them."""
    return _gate(width) | {(width - 2, 2)}


def _gate(width: int) -> set[tuple[int, int]]:
    return {(width, 1), (width - 1, 1), (width - 2, 1)}


def _is_third(taken: set[tuple[int, int]]) -> bool:
    """Return whether three machines are in a row."""
    return any(
        (x + step_x, y + step_y) in taken and (x + 2 * step_x, y + 2 * step_y) in taken
        for x, y in taken
        for step_x, step_y in _AHEAD[:4]
    )


def _closes_a_corner(taken: set[tuple[int, int]], width: int, height: int) -> bool:
    corners = (((2, 1), (1, 2)), ((2, height), (1, height - 1)), ((width - 1, height), (width, height - 1)))
    return any(set(pair) <= taken for pair in corners)
