"""Simulated sensors for the effects of a dummy's actions.

An action with a sensed effect ends when a sensor reports the effect. The effects of dummies have no sensor,
so they are asserted here.
"""

from __future__ import annotations

from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol, Value

_PENDING = "domain-pending-sensed-fact"
_ActionKey = tuple[Value, Value, Value]


class PretendedSensing:
    """The sensed effects of actions that dummies have executed, in one environment."""

    def __init__(self, env: ClipsEnvironment) -> None:
        self._env = env
        self._executed: set[_ActionKey] = set()

    def executed(self, skill_id: str) -> None:
        """Note that a dummy has executed a skill, while the rules still know its action."""
        for _index, _template, slots in self._env.facts("skill-action-execinfo"):
            if slots["skill-id"] == skill_id:
                self._executed.add((slots["goal-id"], slots["plan-id"], slots["action-id"]))

    def sense(self) -> None:
        """Assert the pending effects of these actions."""
        if not self._executed:
            return
        senses = self._env.has_template(_PENDING)
        pending = [slots for _, _, slots in self._env.facts(_PENDING)] if senses else []
        if not pending:
            self._forget()
        for slots in pending:
            if (slots["goal-id"], slots["plan-id"], slots["action-id"]) in self._executed:
                self._set_fact(slots["name"], slots["param-values"], holds=slots["type"] == "POSITIVE")

    def _forget(self) -> None:
        """Forget removed actions, so that an idle executive skips the search for their facts."""
        existing = {
            (slots["goal-id"], slots["plan-id"], slots["id"])
            for _, _, slots in self._env.facts("plan-action")
        }
        self._executed &= existing

    def _set_fact(self, predicate: Value, values: Value, *, holds: bool) -> None:
        indices = [
            index
            for index, _, slots in self._env.facts("domain-fact")
            if slots["name"] == predicate and slots["param-values"] == values
        ]
        if holds and not indices:
            self._env.assert_fact("domain-fact", {"name": Symbol(str(predicate)), "param-values": values})
        elif not holds:
            for index in indices:
                self._env.retract(index)
