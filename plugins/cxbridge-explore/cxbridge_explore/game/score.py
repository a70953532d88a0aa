"""The score of a game, the work of its robots, and the result with both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Final

POST_GAME: Final = "POST_GAME"


@dataclass(frozen=True, slots=True)
class Delivery:
    """A delivered product.

    :param complexity: the amount or kind of work, as the game calls it.
    :param order: the number of the order.
    :param game_time: the time in seconds since the start of the production.
    """

    order: int
    complexity: str
    team: str
    game_time: float


@dataclass(frozen=True, slots=True)
class Award:
    """Points that a team was awarded, or lost if the number is negative.

    :param game_time: the time in seconds since the start of the phase.
    :param category: the reason without names and numbers.
    """

    team: str
    points: int
    game_time: float
    phase: str
    reason: str
    category: str


@dataclass(frozen=True, slots=True)
class ProductOrder:
    """An ordered product.

    :param order: the number of the order.
    :param begin: the start of the delivery window, in seconds since the start of the production.
    :param end: the end of the delivery window.
    """

    order: int
    complexity: str
    begin: float
    end: float


@dataclass(frozen=True, slots=True)
class Score:
    """The score of a game.

    :param points: the points by team.
    :param game_time: the time in seconds since the start of the phase.
    :param orders: the announced orders.
    """

    points: dict[str, int]
    deliveries: tuple[Delivery, ...]
    awards: tuple[Award, ...]
    phase: str
    game_time: float
    orders: tuple[ProductOrder, ...] = ()

    @property
    def categories(self) -> dict[str, dict[str, int]]:
        """The points by team and category, in the order of the first award."""
        points_by_category: dict[str, dict[str, int]] = {team: {} for team in self.points}
        for award in self.awards:
            points = points_by_category.setdefault(award.team, {})
            points[award.category] = points.get(award.category, 0) + award.points
        return points_by_category

    def delivery_times(self, order: ProductOrder) -> list[float]:
        """Return the times at which products of an order were delivered, as in :class:`Delivery`."""
        return [delivery.game_time for delivery in self.deliveries if delivery.order == order.order]

    def as_dict(self) -> dict[str, Any]:
        return {
            "points": self.points,
            "categories": self.categories,
            "deliveries": [asdict(delivery) for delivery in self.deliveries],
            "phase": self.phase,
            "game_time": self.game_time,
            "awards": [asdict(award) for award in self.awards],
            "orders": [{**asdict(order), "delivered": self.delivery_times(order)} for order in self.orders],
        }


@dataclass(frozen=True, slots=True)
class RobotWork:
    """The work of a robot, or of another executor of skills, in a game.

    :param busy_seconds: the time of the whole game in which skills were executed.
    :param idle_seconds: the time of the production in which no skill was executed.
    :param failed: the number of failed skills by error.
    """

    busy_seconds: float
    idle_seconds: float
    failed: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class GameResult:
    """The result of a game.

    :param is_over: whether the game is finished.
    :param wall_seconds: the real time of the game.
    :param faults: the errors of cxbridge itself, and of the program that judges.
    :param machine_seconds: the seconds of the production that each machine was in each state.
    :param undefined_constructs: the constructs of the agent that CLIPS rejected, with place and reason.
    :param simtest: the result of the agent's own tests, ``SUCCEEDED`` or ``FAILED``; empty without tests.
    """

    score: Score
    is_over: bool
    seed: int
    wall_seconds: float
    robots: Mapping[str, RobotWork]
    machine_seconds: Mapping[str, Mapping[str, float]]
    faults: tuple[str, ...] = ()
    undefined_constructs: tuple[str, ...] = ()
    simtest: str = ""

    @property
    def points(self) -> int:
        """The points of the team that plays: the maximum, since the other team is idle."""
        return max(self.score.points.values(), default=0)

    @property
    def outcome(self) -> dict[str, Any]:
        """The members of the result that are equal in each game of an agent with the same seed."""
        return {
            **self.score.as_dict(),
            "robots": {name: asdict(work) for name, work in self.robots.items()},
            "machines": self.machine_seconds,
            "seed": self.seed,
        }

    def as_dict(self) -> dict[str, Any]:
        return {
            **self.outcome,
            "complete": self.is_over,
            "undefined": list(self.undefined_constructs),
            "faults": list(self.faults),
            **({"simtest": self.simtest} if self.simtest else {}),
            "wall_seconds": self.wall_seconds,
        }
