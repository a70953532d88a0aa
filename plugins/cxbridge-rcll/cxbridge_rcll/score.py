"""Points, deliveries and phase of a game, from the facts of the referee."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from cxbridge.executive.host.values import Value
from cxbridge_explore.game.score import Award, Delivery, ProductOrder, Score
from cxbridge_rcll.referee import Referee

TEAMS: Final = ("CYAN", "MAGENTA")

# The end of the words that all awards of a category share, before a machine, a robot or a number.
_DETAILS: Final = re.compile(r" (?:at|to|of|for) |:| \(")
_LATE: Final = " Late (deadline"


def phase_of(referee: Referee) -> str:
    """Return the phase; empty before the rules have a game."""
    return next((str(phase) for (phase,) in referee.columns("gamestate", "phase")), "")


def states_of(referee: Referee) -> dict[str, str]:
    """Return the states of the machines by name."""
    return {str(name): str(state) for name, state in referee.columns("machine", "name", "state")}


def category_of(reason: str) -> str:
    """Return a reason without the names of machine, robot or order: ``Retrieved cap``."""
    words = _DETAILS.split(reason, maxsplit=1)[0].strip()
    return f"{words} late" if _LATE in reason else words


def score_of(referee: Referee) -> Score:
    """Return the score, with awards and deliveries by time: facts are in the order of their last change."""
    awards = sorted(
        (
            Award(
                str(slots["team"]),
                _integer(slots["points"]),
                _seconds(slots["game-time"]),
                str(slots["phase"]),
                str(slots["reason"]),
                category_of(str(slots["reason"])),
            )
            for slots in referee.facts("points")
        ),
        key=lambda award: award.game_time,
    )
    complexity = {_integer(slots["id"]): str(slots["complexity"]) for slots in referee.facts("order")}
    deliveries = sorted(
        (
            Delivery(
                _integer(slots["order"]),
                complexity.get(_integer(slots["order"]), ""),
                str(slots["team"]),
                _seconds(slots["game-time"]),
            )
            for slots in referee.facts("product-processed")
            # Only a confirmed product counts; the order 0 means that no order has asked for it.
            if slots["mtype"] == "DS" and slots["confirmed"] == "TRUE" and _integer(slots["order"])
        ),
        key=lambda delivery: delivery.game_time,
    )
    state = next(referee.facts("gamestate"), {})
    points = state.get("points")
    team_points = [_integer(value) for value in points] if isinstance(points, tuple) else [0, 0]
    time = next(referee.facts("time-info"), {"game-time": 0.0})
    return Score(
        dict(zip(TEAMS, team_points, strict=True)),
        tuple(deliveries),
        tuple(awards),
        str(state.get("phase", "")),
        _seconds(time["game-time"]),
        tuple(sorted(_orders(referee), key=lambda order: order.order)),
    )


def _orders(referee: Referee) -> Iterator[ProductOrder]:
    """Yield the orders that are part of the game."""
    for slots in referee.facts("order"):
        if slots["active"] == "TRUE":
            period = slots["delivery-period"]
            begin, end = period if isinstance(period, tuple) else (0, 0)
            yield ProductOrder(
                _integer(slots["id"]), str(slots["complexity"]), _integer(begin), _integer(end)
            )


def _integer(value: Value) -> int:
    return value if isinstance(value, int) else 0


def _seconds(value: Value) -> float:
    return round(value, 3) if isinstance(value, int | float) else 0.0
