"""What there is to see of a CLIPS environment. To be called by the main loop's thread."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from clips._clips import lib

from cxbridge.executive.capi import NULL, CData

if TYPE_CHECKING:
    from cxbridge.executive.environment import ClipsEnvironment


def census(env: ClipsEnvironment) -> dict[str, int]:
    """Return how many facts, rules and activations there are."""
    with env.lock:
        return {
            "facts": _count(env, lib.GetNextFact),
            "rules": _count(env, lib.GetNextDefrule),
            "agenda": _count(env, lib.GetNextActivation),
        }


def _count(env: ClipsEnvironment, following: Callable[[CData, CData], CData]) -> int:
    count, item = 0, following(env.env, NULL)
    while item != NULL:
        count, item = count + 1, following(env.env, item)
    return count
