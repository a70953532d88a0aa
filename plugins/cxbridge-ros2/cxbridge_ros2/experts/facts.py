"""The problem in the facts of a CLIPS environment, which rules and clients change."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from cxbridge.errors import PddlError
from cxbridge.executive.features.config import clips_scalar
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol
from cxbridge.executive.pddl.ast import Ground
from cxbridge.executive.problem.conditions import Slots, slot_texts
from cxbridge.executive.problem.facts import (
    FUNCTION_TEMPLATE,
    OBJECT_TEMPLATE,
    PREDICATE_TEMPLATE,
    ground_of_slots,
    numbers_in,
    set_number,
    slots_of_ground,
)
from cxbridge_ros2.experts.knowledge import Knowledge

_GOAL_TEMPLATE: Final = "problem-goal"
# Template of facts that the CX core asserts for each object, but does not retract with the object.
_TYPE_TEMPLATE: Final = "domain-obj-is-of-type"


class FactKnowledge(Knowledge):
    """Knowledge stored as facts.

    :param env: the environment, whose lock the caller holds.
    :param goal_numbers: numbers for the ids of new goals.
    """

    def __init__(self, env: ClipsEnvironment, goal_numbers: Iterator[int]) -> None:
        self._env = env
        self._goal_numbers = goal_numbers

    @property
    def instances(self) -> dict[str, str]:
        return {
            str(name): str(type_name)
            for name, type_name in self._env.columns(OBJECT_TEMPLATE, "name", "type")
        }

    @property
    def predicates(self) -> list[Ground]:
        return [*dict.fromkeys(ground_of_slots(slots) for _, _, slots in self._env.facts(PREDICATE_TEMPLATE))]

    @property
    def functions(self) -> dict[Ground, float]:
        return numbers_in(self._env)

    @property
    def goal(self) -> str:
        """The formula of the latest goal; empty without a goal."""
        return next(
            (str(formula) for (formula,) in reversed([*self._env.columns(_GOAL_TEMPLATE, "formula")])), ""
        )

    def put_instance(self, name: str, type_name: str) -> None:
        self._assert(OBJECT_TEMPLATE, {"name": clips_scalar(name), "type": Symbol(type_name)})

    def put_predicate(self, ground: Ground) -> None:
        self._assert(PREDICATE_TEMPLATE, slots_of_ground(ground))

    def put_function(self, ground: Ground, value: float) -> None:
        set_number(self._env, ground, value)

    def put_goal(self, formula: str) -> None:
        """Assert a goal in place of all current goals."""
        self._retract(_GOAL_TEMPLATE, lambda _slots: True)
        if formula:
            self._assert(
                _GOAL_TEMPLATE,
                {"id": Symbol(f"{_GOAL_TEMPLATE}-{next(self._goal_numbers)}"), "formula": formula},
            )

    def drop_instance(self, name: str) -> None:
        """Retract an object and its type facts, whose first value is the object."""
        self._retract(OBJECT_TEMPLATE, lambda slots: str(slots["name"]) == name)
        self._retract(_TYPE_TEMPLATE, lambda slots: slot_texts(slots, "implied")[:1] == [name])

    def drop_predicate(self, ground: Ground) -> None:
        self._retract(PREDICATE_TEMPLATE, lambda slots: ground_of_slots(slots) == ground)

    def drop_function(self, ground: Ground) -> None:
        self._retract(FUNCTION_TEMPLATE, lambda slots: ground_of_slots(slots) == ground)

    def _assert(self, template: str, slots: Slots) -> None:
        if not self._env.has_template(template):
            raise PddlError(f"the agent has no template {template}", hint="use a core that stores the domain")
        self._env.assert_fact(template, slots)

    def _retract(self, template: str, matches: Callable[[Slots], bool]) -> None:
        for index, _, slots in list(self._env.facts(template)):
            if matches(slots):
                self._env.retract(index)
