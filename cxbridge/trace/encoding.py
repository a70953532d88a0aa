"""Events to JSON, fast: the same text as :func:`cxbridge.trace.codec.dump` of their plain form.

One function a kind, with the names of its fields written out: recording must not slow down what it records.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import Enum
from json.encoder import encode_basestring as quoted
from typing import Any

from cxbridge.events import (
    Event,
    FactChange,
    GoalTransition,
    InterfaceMessage,
    InterfaceWrite,
    LogLine,
    PlanActionTransition,
    PlannerCall,
    RuleFired,
    SkillStatus,
)
from cxbridge.trace.codec import dump, plain_values


def _values(values: Mapping[str, Any]) -> str:
    """Return the values of an interface or a message as JSON."""
    return f"{{{','.join([f'{quoted(name)}:{_value(value)}' for name, value in values.items()])}}}"


def _value(value: Any) -> str:
    kind = type(value)
    if kind is str:
        return quoted(value)
    if kind is int:
        return int.__repr__(value)
    if kind is bool:
        return "true" if value else "false"
    if isinstance(value, Enum):
        return quoted(value._name_)  # what .name finds by a detour
    return dump(plain_values({"": value}))[len('{"":') : -len("}")]


def _log(e: LogLine) -> str:
    return (
        f'{{"time_us":{e.time_us},"level":"{e.level._value_}","component":{quoted(e.component)}'
        f',"text":{quoted(e.text)}}}'
    )


def _rule(e: RuleFired) -> str:
    return (
        f'{{"time_us":{e.time_us},"env":{quoted(e.env)},"number":{e.number},"rule":{quoted(e.rule)}'
        f',"basis":{quoted(e.basis)}}}'
    )


def _fact(e: FactChange) -> str:
    return (
        f'{{"time_us":{e.time_us},"env":{quoted(e.env)},"asserted":{"true" if e.asserted else "false"}'
        f',"index":{e.index},"template":{quoted(e.template)},"text":{quoted(e.text)}}}'
    )


def _goal(e: GoalTransition) -> str:
    return (
        f'{{"time_us":{e.time_us},"env":{quoted(e.env)},"goal":{quoted(e.goal)}'
        f',"goal_class":{quoted(e.goal_class)},"sub_type":{quoted(e.sub_type)},"parent":{quoted(e.parent)}'
        f',"mode":{quoted(e.mode)},"outcome":{quoted(e.outcome)},"error":{quoted(e.error)}}}'
    )


def _action(e: PlanActionTransition) -> str:
    return (
        f'{{"time_us":{e.time_us},"env":{quoted(e.env)},"action_id":{quoted(e.action_id)}'
        f',"goal":{quoted(e.goal)},"plan":{quoted(e.plan)},"action":{quoted(e.action)}'
        f',"state":{quoted(e.state)}}}'
    )


def _skill(e: SkillStatus) -> str:
    return (
        f'{{"time_us":{e.time_us},"env":{quoted(e.env)},"skiller":{quoted(e.skiller)}'
        f',"skill_string":{quoted(e.skill_string)},"msgid":{e.msgid},"status":{quoted(e.status)}}}'
    )


def _write(e: InterfaceWrite) -> str:
    return f'{{"time_us":{e.time_us},"uid":{quoted(e.uid)},"values":{_values(e.values)}}}'


def _message(e: InterfaceMessage) -> str:
    return (
        f'{{"time_us":{e.time_us},"uid":{quoted(e.uid)},"message":{quoted(e.message)},"msgid":{e.msgid}'
        f',"sender":{quoted(e.sender)},"outcome":{quoted(e.outcome)},"values":{_values(e.values)}}}'
    )


def _planner(e: PlannerCall) -> str:
    return (
        f'{{"time_us":{e.time_us},"env":{quoted(e.env)},"call":{quoted(e.call)},"goal":{quoted(e.goal)}'
        f',"planner":{quoted(e.planner)},"domain":{quoted(e.domain)},"problem":{quoted(e.problem)}'
        f',"status":{quoted(e.status)},"duration_us":{e.duration_us},"actions":{e.actions}'
        f',"reason":{quoted(e.reason)},"plan":{quoted(e.plan)}}}'
    )


# each function takes events of its own type, and is called with no others
ENCODERS: Mapping[type[Event], Callable[[Any], str]] = {
    LogLine: _log,
    RuleFired: _rule,
    FactChange: _fact,
    GoalTransition: _goal,
    PlanActionTransition: _action,
    SkillStatus: _skill,
    InterfaceWrite: _write,
    InterfaceMessage: _message,
    PlannerCall: _planner,
}
"""What makes JSON of an event, by its type."""
