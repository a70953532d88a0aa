"""Places the machines of a team randomly in one half of the field.

Robots must reach each machine. The league and its referee box therefore have these rules: no machine in the
entry zones or in one zone in front of them, no side of a machine towards a wall, a free zone before each
side, no row of three machines, no machines that cut off a corner zone.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from random import Random
from typing import Final

ANGLES: Final = tuple(range(0, 360, 45))  # degrees
# the step in x and y to the next zone in the direction of each angle
_STEPS_BY_DIRECTION: Final = ((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1))

DELIVERY_STATION: Final = 7  # the number of the only machine that robots use from one side

# the names of the machines by their numbers in the referee's rules
MACHINE_NAMES: Final = {1: "BS", 2: "CS1", 3: "CS2", 4: "RS1", 5: "RS2", 6: "SS", DELIVERY_STATION: "DS"}

_MAX_TRIES: Final = 10_000  # attempts after which an arrangement counts as impossible; chosen freely
# random placements of a machine after which an attempt has failed; chosen freely
_CANDIDATE_COUNT: Final = 40


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
        """The column and the row of the machine's zone."""
        return self.x, self.y

    def side_zones(self) -> Iterator[tuple[int, int]]:
        """Yield the zones before the machine's sides, which must be free for robots."""
        angles = (self.angle,) if self.machine == DELIVERY_STATION else (self.angle, self.angle + 180)
        for angle in angles:
            direction_index = angle // 45 % len(_STEPS_BY_DIRECTION)
            step_x, step_y = _STEPS_BY_DIRECTION[direction_index]
            yield self.x + step_x, self.y + step_y
            if direction_index % 2:  # robots reach a diagonal zone through its two neighbours
                yield self.x + step_x, self.y
                yield self.x, self.y + step_y


def arrange_machines(
    random: Random, machines: Collection[int], width: int, height: int
) -> list[Placement] | None:
    """Return random positions of machines; None if no arrangement fits.

    :param machines: the numbers of the machines.
    :param width: the width of the half in zones.
    :param height: the height of the half in zones.
    """
    zones = [(x, y) for x in range(1, width + 1) for y in range(1, height + 1)]
    # Machines are placed one after another. If there is no room for the next machine, a new attempt begins.
    for _ in range(_MAX_TRIES):
        placements: list[Placement] = []
        for machine in sorted(machines):  # the order determines which random numbers each machine gets
            candidates = [
                Placement(machine, *random.choice(zones), random.choice(ANGLES))
                for _ in range(_CANDIDATE_COUNT)
            ]
            fitting_placements = (
                candidate for candidate in candidates if can_place(candidate, placements, width, height)
            )
            placement = next(fitting_placements, None)
            if placement is None:
                break
            placements.append(placement)
        else:
            return placements
    return None


def can_place(candidate: Placement, placements: Collection[Placement], width: int, height: int) -> bool:
    """Return whether a placement obeys the rules, given the machines that are placed already."""
    zones = {placement.zone for placement in placements} | {candidate.zone}
    if len(zones) != len(placements) + 1 or candidate.zone in _blocked_zones(width):
        return False
    side_zones = set(candidate.side_zones())
    if any(not (1 <= x <= width and 1 <= y <= height) for x, y in side_zones) or side_zones & _entry_zones(
        width
    ):
        return False
    for placement in placements:
        other_side_zones = set(placement.side_zones())
        if (
            candidate.zone in other_side_zones
            or placement.zone in side_zones
            or other_side_zones & side_zones
        ):
            return False
    return not _has_row_of_three(zones) and not _closes_corner(zones, width, height)


def _blocked_zones(width: int) -> set[tuple[int, int]]:
    """Return the zones in which no machine may be: the entry zones, and one zone in front of them."""
    # of the zones in front of the entry zones, the referee box blocks only this zone
    return _entry_zones(width) | {(width - 2, 2)}


def _entry_zones(width: int) -> set[tuple[int, int]]:
    """Return the entry zones, where people insert robots."""
    return {(width, 1), (width - 1, 1), (width - 2, 1)}


def _has_row_of_three(zones: set[tuple[int, int]]) -> bool:
    """Return whether three machines are in a row."""
    return any(
        (x + step_x, y + step_y) in zones and (x + 2 * step_x, y + 2 * step_y) in zones
        for x, y in zones
        for step_x, step_y in _STEPS_BY_DIRECTION[:4]  # the remaining four directions are opposite to these
    )


def _closes_corner(zones: set[tuple[int, int]], width: int, height: int) -> bool:
    """Return whether machines occupy both zones next to a corner zone."""
    # the zones next to each corner, except the corner of the entrance, which has no machines
    zone_pairs = (
        ((2, 1), (1, 2)),
        ((2, height), (1, height - 1)),
        ((width - 1, height), (width, height - 1)),
    )
    return any(set(pair) <= zones for pair in zone_pairs)
