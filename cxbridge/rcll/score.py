"""How a game stands: points, deliveries, phase; from the facts of the referee."""

from __future__ import annotations

from typing import Final

from cxbridge.executive.host.values import Value
from cxbridge.game.score import Award, Delivery, Score
from cxbridge.rcll.referee import Referee

TEAMS: Final = ("CYAN", "MAGENTA")


def phase_of(referee: Referee) -> str:
    """Return the phase of the game."""
    return next((str(slots["phase"]) for slots in referee.facts("gamestate")), "")


def score_of(referee: Referee) -> Score:
    """Return how the game stands."""
    awards = sorted(
        (
            Award(
                str(slots["team"]),
                _whole(slots["points"]),
                _seconds(slots["game-time"]),
                str(slots["phase"]),
                str(slots["reason"]),
            )
            for slots in referee.facts("points")
        ),
        key=lambda award: award.game_time,
    )
    complexity = {_whole(slots["id"]): str(slots["complexity"]) for slots in referee.facts("order")}
    deliveries = sorted(
        (
            Delivery(
                _whole(slots["order"]),
                complexity.get(_whole(slots["order"]), ""),
                str(slots["team"]),
                _seconds(slots["game-time"]),
            )
            for slots in referee.facts("product-processed")
            if slots["mtype"] == "DS" and slots["confirmed"] == "TRUE" and _whole(slots["order"])
        ),
        key=lambda delivery: delivery.game_time,
    )
    state = next(referee.facts("gamestate"), {})
    points = state.get("points")
    given = [_whole(each) for each in points] if isinstance(points, tuple) else [0, 0]
    time = next(referee.facts("time-info"), {"game-time": 0.0})
    return Score(
        dict(zip(TEAMS, given, strict=True)),
        tuple(deliveries),
        tuple(awards),
        str(state.get("phase", "")),
        _seconds(time["game-time"]),
    )


def _whole(value: Value) -> int:
    return value if isinstance(value, int) else 0


def _seconds(value: Value) -> float:
    return round(value, 3) if isinstance(value, int | float) else 0.0
