"""Reads the points, the deliveries and the phase of a game from the facts of the referee."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, Final

from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge_explore.game.score import Award, Delivery, ProductOrder, Score

TEAMS: Final = ("CYAN", "MAGENTA")  # in the order of the points in the referee's facts

# the start of the details in the reason for an award: a machine, a robot or a number
_DETAIL_START: Final = re.compile(r" (?:at|to|of|for) |:| \(")
# the referee's words in the reason for a late delivery
_LATE_MARK: Final = " Late (deadline"


def read_phase(env: ClipsEnvironment) -> str:
    """Return the phase; empty before the rules have asserted the state of the game."""
    return next((str(phase) for (phase,) in env.columns("gamestate", "phase")), "")


def find_award_category(reason: str) -> str:
    """Return the reason for an award without its details, e.g. ``Retrieved cap``.

    ``late`` is appended for a late delivery.
    """
    category = _DETAIL_START.split(reason, maxsplit=1)[0].strip()
    return f"{category} late" if _LATE_MARK in reason else category


def read_score(env: ClipsEnvironment) -> Score:
    """Return the score, with awards and deliveries sorted by time: CLIPS may yield facts in another order.

    :param env: the environment of the referee's rules.
    """
    awards = sorted(
        (
            Award(
                str(slots["team"]),
                slots["points"],
                game_time=round(slots["game-time"], 3),
                phase=str(slots["phase"]),
                reason=str(slots["reason"]),
                category=find_award_category(str(slots["reason"])),
            )
            for slots in _read_facts(env, "points")
        ),
        key=lambda award: award.game_time,
    )
    orders = {slots["id"]: slots for slots in _read_facts(env, "order")}
    deliveries = sorted(
        (
            # a delivery without a known order has an empty complexity
            Delivery(
                slots["order"],
                str(orders[slots["order"]]["complexity"]) if slots["order"] in orders else "",
                str(slots["team"]),
                round(slots["game-time"], 3),
            )
            for slots in _read_facts(env, "product-processed")
            # only a confirmed product at the delivery station (DS) counts, and only a product with an order:
            # the number 0 means no order
            if slots["mtype"] == "DS" and slots["confirmed"] == "TRUE" and slots["order"]
        ),
        key=lambda delivery: delivery.game_time,
    )
    # the rules assert the facts in their first loop, and a game may end before
    points = next((slots["points"] for slots in _read_facts(env, "gamestate")), (0, 0))
    game_time = next((slots["game-time"] for slots in _read_facts(env, "time-info")), 0.0)
    return Score(
        points=dict(zip(TEAMS, points, strict=True)),
        deliveries=tuple(deliveries),
        awards=tuple(awards),
        phase=read_phase(env),
        game_time=round(game_time, 3),
        orders=tuple(
            ProductOrder(number, str(slots["complexity"]), *slots["delivery-period"])
            for number, slots in sorted(orders.items())
            if slots["active"] == "TRUE"
        ),
    )


def _read_facts(env: ClipsEnvironment, template: str) -> Iterator[dict[str, Any]]:
    """Yield the slots of each fact of a deftemplate; their types are those in the referee's rules."""
    return (slots for _, _, slots in env.facts(template))
