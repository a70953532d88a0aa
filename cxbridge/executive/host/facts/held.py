"""Facts that the host has made and will retract.

By their handles: to look for a fact by its index means to walk through all facts.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Self

from clips._clips import lib

from cxbridge.executive.host.capi import NULL, CData
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Value


class HeldFact:
    """A fact, also after rules have retracted it: CLIPS keeps its memory until it is let go."""

    __slots__ = ("_fact",)

    def __init__(self, fact: CData) -> None:
        lib.RetainFact(fact)
        self._fact = fact

    @classmethod
    def make(cls, env: ClipsEnvironment, template: str, slots: Mapping[str, Value]) -> Self | None:
        """Assert a fact and hold it; None when CLIPS refuses it.

        :raises ClipsError: for an unknown deftemplate or slot.
        """
        fact = env.add_fact(template, slots)
        return None if fact == NULL else cls(fact)

    def retract(self) -> None:
        """Retract the fact, unless that was done, and let go of it. To be called once."""
        fact, self._fact = self._fact, NULL
        if lib.FactExistp(fact):
            lib.Retract(fact)
        lib.ReleaseFact(fact)

    def release(self) -> None:
        """Let go of the fact, and leave it where it is."""
        fact, self._fact = self._fact, NULL
        lib.ReleaseFact(fact)
