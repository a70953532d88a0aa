"""Reads the points, the deliveries and the phase of a game from the facts of the referee."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from cxbridge.executive.host.values import Value
from cxbridge_explore.game.score import Award, Delivery, ProductOrder, Score
from cxbridge_rcll.referee import Referee

TEAMS: Final = ("CYAN", "MAGENTA")

# the start of the details in the reason for an award: a machine, a robot or a number
_DETAIL_START: Final = re.compile(r" (?:at|to|of|for) |:| \(")
# the referee's words in the reason for a late delivery
_LATE_MARK: Final = " Late (deadline"


def read_phase(referee: Referee) -> str:
    """Return the phase; empty before the rules have asserted the state of the game."""
    return next((str(phase) for (phase,) in referee.columns("gamestate", "phase")), "")


def read_machine_states(referee: Referee) -> dict[str, str]:
    """Return the states of the machines by name."""
    return {str(name): str(state) for name, state in referee.columns("machine", "name", "state")}


def find_award_category(reason: str) -> str:
    """Return the reason for an award without its details, e.g. ``Retrieved cap``.

    ``late`` is appended for a late delivery.
    """
    category = _DETAIL_START.split(reason, maxsplit=1)[0].strip()
    return f"{category} late" if _LATE_MARK in reason else category


def read_score(referee: Referee) -> Score:
    """Return the score, with awards and deliveries sorted by time: CLIPS yields facts in another order."""
    awards = sorted(
        (
            Award(
                str(slots["team"]),
                _to_integer(slots["points"]),
                _to_seconds(slots["game-time"]),
                str(slots["phase"]),
                str(slots["reason"]),
                find_award_category(str(slots["reason"])),
            )
            for slots in referee.facts("points")
        ),
        key=lambda award: award.game_time,
    )
    complexity_by_order = {
        _to_integer(slots["id"]): str(slots["complexity"]) for slots in referee.facts("order")
    }
    deliveries = sorted(
        (
            Delivery(
                _to_integer(slots["order"]),
                complexity_by_order.get(_to_integer(slots["order"]), ""),
                str(slots["team"]),
                _to_seconds(slots["game-time"]),
            )
            for slots in referee.facts("product-processed")
            # only a confirmed product at the delivery station (DS) counts, and only if it has an order: the
            # order 0 stands for none
            if slots["mtype"] == "DS" and slots["confirmed"] == "TRUE" and _to_integer(slots["order"])
        ),
        key=lambda delivery: delivery.game_time,
    )
    game_slots = next(referee.facts("gamestate"), {})
    points = game_slots.get("points")
    team_points = [_to_integer(value) for value in points] if isinstance(points, tuple) else [0, 0]
    time_slots = next(referee.facts("time-info"), {"game-time": 0.0})
    return Score(
        dict(zip(TEAMS, team_points, strict=True)),
        tuple(deliveries),
        tuple(awards),
        str(game_slots.get("phase", "")),
        _to_seconds(time_slots["game-time"]),
        tuple(sorted(_read_orders(referee), key=lambda product_order: product_order.order)),
    )


def _read_orders(referee: Referee) -> Iterator[ProductOrder]:
    """Yield the orders that are part of the game."""
    for slots in referee.facts("order"):
        if slots["active"] == "TRUE":
            period = slots["delivery-period"]
            begin, end = period if isinstance(period, tuple) else (0, 0)
            yield ProductOrder(
                _to_integer(slots["id"]), str(slots["complexity"]), _to_integer(begin), _to_integer(end)
            )


def _to_integer(value: Value) -> int:
    """Return an integer; 0 for a value of another type."""
    return value if isinstance(value, int) else 0


def _to_seconds(value: Value) -> float:
    """Return a number rounded to milliseconds; 0 for a value of another type."""
    return round(value, 3) if isinstance(value, int | float) else 0.0
