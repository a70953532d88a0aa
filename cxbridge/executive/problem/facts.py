"""The world model of the CX core: objects, domain facts and function values, as facts of an environment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from cxbridge.executive.features.config import clips_scalar
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol, Value
from cxbridge.executive.pddl.ast import Ground

# the templates of facts about function values, about objects, and about true atoms of predicates
FUNCTION_TEMPLATE: Final = "problem-function"
OBJECT_TEMPLATE: Final = "domain-object"
PREDICATE_TEMPLATE: Final = "domain-fact"

Slots = Mapping[str, Value]


def set_number(env: ClipsEnvironment, ground: Ground, value: float) -> None:
    """Set the value of a ground function: replace its facts, or assert its first fact."""
    for index, _, slots in list(env.facts(FUNCTION_TEMPLATE)):
        if ground_of_slots(slots) == ground:
            env.retract(index)
    env.assert_fact(FUNCTION_TEMPLATE, {**slots_of_ground(ground), "value": float(value)})


def numbers_in(env: ClipsEnvironment) -> dict[Ground, float]:
    """Return the values of all ground functions in an environment; other values than numbers count as 0."""
    numbers = {}
    for _, _, slots in env.facts(FUNCTION_TEMPLATE):
        value = slots["value"]
        # rules can store a value of another type: CLIPS does not check the types of slots during a run
        numbers[ground_of_slots(slots)] = float(value) if isinstance(value, int | float) else 0.0
    return numbers


def slots_of_ground(ground: Ground) -> dict[str, Value]:
    """Return the slots of the fact about a ground predicate or function."""
    name, arguments = ground
    return {"name": Symbol(name), "param-values": tuple(map(clips_scalar, arguments))}


def ground_of_slots(slots: Slots) -> Ground:
    """Return the ground predicate or function in a fact's slots."""
    values = slots["param-values"]
    return str(slots["name"]), tuple(map(str, values)) if isinstance(values, tuple) else (str(values),)
