"""What is known of a problem, as facts of an environment: the world model of the CX core."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Mapping
from typing import Final

from cxbridge.errors import PddlError
from cxbridge.executive.features.config import clips_scalar
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol, Value
from cxbridge.executive.pddl.ast import Ground
from cxbridge.executive.problem.knowledge import Knowledge

FUNCTION: Final = "problem-function"
GOAL: Final = "problem-goal"
INSTANCE: Final = "domain-object"
PREDICATE: Final = "domain-fact"

_TYPE_OF: Final = "domain-obj-is-of-type"
"""Ordered facts that the core makes of each object, and does not retract with it."""

Slots = Mapping[str, Value]


class FactKnowledge(Knowledge):
    """Keeps it as facts.

    :param env: the environment, whose lock must be held.
    :param numbers: the numbers of goals, so that each has an id of its own.
    """

    def __init__(self, env: ClipsEnvironment, numbers: Iterator[int]) -> None:
        self._env = env
        self._numbers = numbers

    @property
    def instances(self) -> dict[str, str]:
        """The objects with their types."""
        return {str(name): str(kind) for name, kind in self._env.columns(INSTANCE, "name", "type")}

    @property
    def predicates(self) -> list[Ground]:
        """The domain facts."""
        return [*dict.fromkeys(_ground(slots) for _, _, slots in self._env.facts(PREDICATE))]

    @property
    def functions(self) -> dict[Ground, float]:
        """The values of functions."""
        return numbers_in(self._env)

    @property
    def goal(self) -> str:
        """The formula of the last goal."""
        return next((str(formula) for (formula,) in reversed([*self._env.columns(GOAL, "formula")])), "")

    def put_instance(self, name: str, kind: str) -> None:
        """Assert an object."""
        self._assert(INSTANCE, {"name": clips_scalar(name), "type": Symbol(kind)})

    def put_predicate(self, ground: Ground) -> None:
        """Assert a domain fact."""
        self._assert(PREDICATE, _slots(ground))

    def put_function(self, ground: Ground, value: float) -> None:
        """Assert the value of a function, in place of what it was."""
        put_number(self._env, ground, value)

    def put_goal(self, formula: str) -> None:
        """Assert a goal, in place of the others."""
        self._retract(GOAL, lambda _slots: True)
        if formula:
            self._assert(GOAL, {"id": Symbol(f"{GOAL}-{next(self._numbers)}"), "formula": formula})

    def drop_instance(self, name: str) -> None:
        """Retract an object, and of which types it is."""
        self._retract(INSTANCE, lambda slots: str(slots["name"]) == name)
        self._retract(_TYPE_OF, lambda slots: _first(slots["implied"]) == name)

    def drop_predicate(self, ground: Ground) -> None:
        """Retract a domain fact."""
        self._retract(PREDICATE, lambda slots: _ground(slots) == ground)

    def drop_function(self, ground: Ground) -> None:
        """Retract the value of a function."""
        self._retract(FUNCTION, lambda slots: _ground(slots) == ground)

    def _assert(self, template: str, slots: Slots) -> None:
        if not self._env.has_template(template):
            raise PddlError(f"the agent has no template {template}", hint="its core has no domain")
        self._env.assert_fact(template, slots)

    def _retract(self, template: str, is_meant: Callable[[Slots], bool]) -> None:
        for index, _, slots in list(self._env.facts(template)):
            if is_meant(slots):
                self._env.retract(index)


def objects_in(env: ClipsEnvironment) -> list[tuple[str, str]]:
    """Return the objects with their types that an environment has."""
    return [(str(name), str(kind)) for name, kind in env.columns(INSTANCE, "name", "type")]


def facts_in(env: ClipsEnvironment, predicates: Container[str]) -> list[Ground]:
    """Return the domain facts of some predicates that an environment has."""
    return [
        (str(name), tuple(map(str, values)))
        for name, values in env.columns(PREDICATE, "name", "param-values")
        if name in predicates and isinstance(values, tuple)
    ]


def put_number(env: ClipsEnvironment, ground: Ground, value: float) -> None:
    """Assert the value of a function, in place of what it was."""
    for index, _, slots in list(env.facts(FUNCTION)):
        if _ground(slots) == ground:
            env.retract(index)
    env.assert_fact(FUNCTION, {**_slots(ground), "value": float(value)})


def numbers_in(env: ClipsEnvironment) -> dict[Ground, float]:
    """Return the values of functions that an environment has."""
    found = {}
    for _, _, slots in env.facts(FUNCTION):
        value = slots["value"]
        found[_ground(slots)] = float(value) if isinstance(value, int | float) else 0.0
    return found


def _slots(ground: Ground) -> dict[str, Value]:
    return {"name": Symbol(ground[0]), "param-values": tuple(map(clips_scalar, ground[1]))}


def _ground(slots: Slots) -> Ground:
    values = slots["param-values"]
    return str(slots["name"]), tuple(map(str, values)) if isinstance(values, tuple) else (str(values),)


def _first(value: Value) -> str:
    return str(value[0]) if isinstance(value, tuple) and value else ""
