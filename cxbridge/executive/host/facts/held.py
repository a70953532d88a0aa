"""Facts that features assert and later retract.

A feature keeps the pointers of such facts, because CLIPS finds a fact by index only by searching all facts.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Self

from clips._clips import lib

from cxbridge.executive.host.capi import NULL, CData
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Value


class HeldFact:
    """A retained fact: its memory stays valid until the release, even after rules have retracted the fact."""

    __slots__ = ("_fact",)

    def __init__(self, fact: CData) -> None:
        lib.RetainFact(fact)
        self._fact = fact

    @classmethod
    def make(cls, env: ClipsEnvironment, template: str, slots: Mapping[str, Value]) -> Self | None:
        """Assert and retain a fact; return None if CLIPS refuses the fact.

        :raises ClipsError: if the deftemplate or a slot is unknown, or a slot cannot hold its value.
        """
        fact = env.assert_fact_pointer(template, slots)
        return None if fact == NULL else cls(fact)

    def retract(self) -> None:
        """Retract the fact if it still exists, and release it. To be called once."""
        if lib.FactExistp(self._fact):
            lib.Retract(self._fact)
        self.release()

    def release(self) -> None:
        """Release the fact without retracting it. To be called once."""
        fact, self._fact = self._fact, NULL
        lib.ReleaseFact(fact)
