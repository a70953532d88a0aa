"""What engines of all kinds have in common: what they understand, their rank, how long they improve plans."""

from __future__ import annotations

from collections.abc import Collection
from math import isfinite
from typing import Final

from msgspec import Struct

from cxbridge.executive.planning.errors import UnknownPlannerError
from cxbridge.executive.planning.needs import Need
from cxbridge.executive.planning.planner import RANK, Planner

_FIRST: Final = ("fast-downward",)
_CLASSICAL: Final = ("lpg", "enhsp", "fd", "ff", "aries", "tamer")
_NUMERIC: Final = ("enhsp", "lpg", "tamer", "aries")
_TEMPORAL: Final = ("lpg", "aries", "tamer", "optic", "popf")
_END_S: Final = 0.5
"""How long before the end of its time an engine that looks for better plans ends."""


class Engine(Struct, frozen=True, kw_only=True):
    """What is known of an engine, as of a planner.

    :param proves: whether the engine is right when it says that there is no plan.
    """

    understands: frozenset[Need]
    ignores: frozenset[Need] = frozenset()
    fails_with: tuple[frozenset[Need], ...] = ()
    proves: bool = True


class EnginePlanner(Planner):
    """A planner that an engine makes.

    :param improve: seconds to look for better plans when the problem has a metric.
    :raises UnknownPlannerError: when ``improve`` is not a number.
    """

    def __init__(self, name: str, engine: Engine, improve: str) -> None:
        self.name = name
        self.understands = engine.understands
        self.ignores = engine.ignores
        self.fails_with = engine.fails_with
        self.proves = engine.proves
        self._improve = _seconds(improve)

    @property
    def improve(self) -> float:
        """How long the engine may look for better plans, in seconds."""
        return min(self._improve, max(0.0, self.seconds - _END_S))

    def rank(self, needs: Collection[Need]) -> int:
        """Return the place in the order of measured success (docs/planning.md)."""
        order: tuple[str, ...]
        if Need.TIME in needs:
            order = _TEMPORAL
        elif Need.NUMBERS in needs:
            order = _NUMERIC
        elif self.name in _FIRST:
            return RANK - 1
        else:
            order = _CLASSICAL
        return RANK + 1 + (order.index(self.name) if self.name in order else len(order))


def _seconds(improve: str) -> float:
    try:
        seconds = float(improve)
    except ValueError:
        seconds = float("nan")
    if not isfinite(seconds):
        raise UnknownPlannerError(f"improve={improve} is not a number of seconds")
    return seconds
