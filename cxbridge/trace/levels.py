"""What can be recorded of a run, and what can be compared: which events belong to which level."""

from __future__ import annotations

from enum import Enum

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

_TRANSITIONS = frozenset({GoalTransition, PlanActionTransition, SkillStatus})


class RecordLevel(Enum):
    """How much of a run is recorded; each level keeps what the one before it keeps, and more."""

    TRANSITIONS = "transitions"
    RULES = "rules"
    FACTS = "facts"

    @property
    def event_types(self) -> frozenset[type[Event]]:
        """The types of events that are recorded at this level."""
        types: frozenset[type[Event]] = _TRANSITIONS | {
            LogLine,
            InterfaceWrite,
            InterfaceMessage,
            PlannerCall,
        }
        if self is not RecordLevel.TRANSITIONS:
            types |= {RuleFired}
        if self is RecordLevel.FACTS:
            types |= {FactChange}
        return types


class View(Enum):
    """What two runs are compared by, and what ``trace cat`` shows."""

    TRANSITIONS = "transitions"
    SKILLS = "skills"
    RULES = "rules"
    FACTS = "facts"
    BLACKBOARD = "blackboard"

    @property
    def event_types(self) -> tuple[type[Event], ...]:
        """The types of events that this view shows."""
        return _VIEWS[self]


_VIEWS: dict[View, tuple[type[Event], ...]] = {
    View.TRANSITIONS: (GoalTransition, PlanActionTransition, SkillStatus),
    View.SKILLS: (SkillStatus,),
    View.RULES: (RuleFired,),
    View.FACTS: (FactChange,),
    View.BLACKBOARD: (InterfaceWrite,),
}
