"""How a game stands: points, deliveries, phase."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Final

from cxbridge_explore.game.timeline import Timeline

POST_GAME: Final = "POST_GAME"
"""The phase of a game that has come to its end."""


@dataclass(frozen=True, slots=True)
class Delivery:
    """A product that was delivered.

    :param order: its number.
    :param complexity: the amount or the kind of work, in the game's words.
    :param game_time: seconds of the production.
    """

    order: int
    complexity: str
    team: str
    game_time: float


@dataclass(frozen=True, slots=True)
class Award:
    """Points that a team was given, or lost.

    :param game_time: seconds of the phase.
    :param category: the kind of reason: without names and numbers.
    """

    team: str
    points: int
    game_time: float
    phase: str
    reason: str
    category: str


@dataclass(frozen=True, slots=True)
class ProductOrder:
    """A product that was ordered.

    :param order: its number.
    :param complexity: as in a delivery.
    :param begin: the second of the production from which on it may be delivered in time.
    :param end: the last such second.
    """

    order: int
    complexity: str
    begin: float
    end: float


@dataclass(frozen=True, slots=True)
class Score:
    """How a game stands.

    :param points: by team.
    :param game_time: seconds of the phase.
    :param orders: those that were announced.
    """

    points: dict[str, int]
    deliveries: tuple[Delivery, ...]
    awards: tuple[Award, ...]
    phase: str
    game_time: float
    orders: tuple[ProductOrder, ...] = ()

    @property
    def categories(self) -> dict[str, dict[str, int]]:
        """The points by team and category, in the order in which they came first."""
        found: dict[str, dict[str, int]] = {team: {} for team in self.points}
        for award in self.awards:
            points = found.setdefault(award.team, {})
            points[award.category] = points.get(award.category, 0) + award.points
        return found

    def delivered(self, order: ProductOrder) -> list[float]:
        """Return when an order was delivered."""
        return [each.game_time for each in self.deliveries if each.order == order.order]

    def as_dict(self) -> dict[str, Any]:
        """Return the printed line."""
        return {
            "points": self.points,
            "categories": self.categories,
            "deliveries": [asdict(each) for each in self.deliveries],
            "phase": self.phase,
            "game_time": self.game_time,
            "awards": [asdict(each) for each in self.awards],
            "orders": [{**asdict(each), "delivered": self.delivered(each)} for each in self.orders],
        }


@dataclass(frozen=True, slots=True)
class RobotWork:
    """The work of a robot, or of another executor of skills, in a game.

    :param busy_seconds: in which it has executed skills.
    :param idle_seconds: those of the production in which it has not.
    :param failed: how often a skill has failed, by the error.
    """

    busy_seconds: float
    idle_seconds: float
    failed: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class GameResult:
    """How a game ended.

    :param is_over: whether it came to its end.
    :param wall_seconds: real ones.
    :param robots: what each one did.
    :param faults: errors of ours that came to light.
    :param undefined: constructs of the agent that CLIPS has refused, each with its place and the reason.
    :param timeline: the intervals of robots and machines.
    :param simtest: the result of the agent's own tests, ``SUCCEEDED`` or ``FAILED``; empty without them.
    """

    score: Score
    is_over: bool
    seed: int
    wall_seconds: float
    robots: Mapping[str, RobotWork]
    faults: tuple[str, ...] = ()
    undefined: tuple[str, ...] = ()
    simtest: str = ""
    timeline: Timeline = field(default_factory=Timeline)

    @property
    def points(self) -> int:
        """The points of the team that plays; its opponent, if there is one, does nothing."""
        return max(self.score.points.values(), default=0)

    @property
    def outcome(self) -> dict[str, Any]:
        """The result of the game: the same for each game with its seed."""
        return {
            **self.score.as_dict(),
            "robots": {name: asdict(work) for name, work in self.robots.items()},
            "machines": self.timeline.machine_use,
            "seed": self.seed,
        }

    def as_dict(self) -> dict[str, Any]:
        """Return the printed line."""
        return {
            **self.outcome,
            "complete": self.is_over,
            "undefined": list(self.undefined),
            "faults": list(self.faults),
            **({"simtest": self.simtest} if self.simtest else {}),
            "wall_seconds": self.wall_seconds,
        }
