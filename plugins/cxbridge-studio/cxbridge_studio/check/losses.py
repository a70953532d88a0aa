"""The consequences of dropped constructs: dependent constructs, and lost goals and actions.

CLIPS drops a construct with a mistake. A finding names the losses, because a missing function or template may
disable rules that are far from the mistake.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final

from cxbridge_studio.agent.names import Name, NameKind, Use
from cxbridge_studio.check.usage import Construct, Usage

_MAX_LISTED: Final = 5  # limit of the names in a message
# The kinds of constructs that other constructs need: CLIPS drops a construct that names an undefined function
# or template.
_NEEDED_KINDS: Final = {
    "deffunction": NameKind.FUNCTION,
    "defgeneric": NameKind.FUNCTION,
    "deftemplate": NameKind.TEMPLATE,
}


@dataclass
class Losses:
    """The losses that dropped constructs cause.

    :param constructs: the names of further constructs, which depend on the dropped constructs.
    :param goals: the goal classes that no remaining construct formulates.
    :param actions: the actions that no remaining construct plans.
    """

    constructs: list[str] = field(default_factory=list)
    goals: list[str] = field(default_factory=list)
    actions: list[str] = field(default_factory=list)

    def __bool__(self) -> bool:
        return bool(self.constructs or self.goals or self.actions)

    def __str__(self) -> str:
        lists = (
            _format_names(self.constructs, ""),
            _format_names(self.goals, "goals of class "),
            _format_names(self.actions, "the action "),
        )
        return f"lost with it: {', '.join(filter(None, lists))}" if self else ""


def _format_names(names: list[str], prefix: str) -> str:
    """Return the first names with a prefix, and the number of further names."""
    further = f" and {len(names) - _MAX_LISTED} more" if len(names) > _MAX_LISTED else ""
    return ", ".join(f"{prefix}{name}" for name in names[:_MAX_LISTED]) + further


class LossFinder:
    """Finds the losses that dropped constructs cause.

    :param own_constructs: the agent's constructs; constructs of a core do not depend on an agent.
    """

    def __init__(self, usage: Usage, own_constructs: Sequence[Construct]) -> None:
        self._usage = usage
        self._own_constructs = own_constructs
        self._matched_classes = usage.model.find_names(NameKind.GOAL_CLASS, Use.MATCHED)

    def find_swallowed_losses(self, file: str, start: int) -> Losses:
        """Return the losses of an unclosed construct, which include all later constructs of the file.

        :param start: the offset of the unclosed construct.
        """
        dropped = [
            construct
            for construct in self._usage.constructs
            if construct.file.path == file and construct.placed.start >= start
        ]
        losses = self.find_losses(dropped)
        losses.constructs[:0] = [construct.name for construct in dropped[1:] if construct.name]
        return losses

    def find_losses(self, dropped: Sequence[Construct]) -> Losses:
        """Return the losses that dropped constructs cause."""
        # The keys are identities, because constructs with the same text are different losses.
        lost_constructs = {id(construct): construct for construct in dropped}
        goals: dict[str, None] = {}
        has_grown = True
        # Losses cause further losses: repeat until nothing is added.
        while has_grown:
            previous_sizes = len(lost_constructs), len(goals)
            goals |= dict.fromkeys(self._find_lost_goals(lost_constructs))
            facts, names = self._find_lost_facts(lost_constructs), self._find_lost_names(lost_constructs)
            for construct in self._own_constructs:
                if id(construct) not in lost_constructs and self._needs_lost_name(
                    construct, names, facts, goals
                ):
                    lost_constructs[id(construct)] = construct
            has_grown = previous_sizes != (len(lost_constructs), len(goals))
        new_ids = lost_constructs.keys() - set(map(id, dropped))
        further = [construct.name for construct in self._usage.constructs if id(construct) in new_ids]
        return Losses(further, list(goals), self._find_lost_actions(lost_constructs))

    def _needs_lost_name(
        self, construct: Construct, names: set[tuple[NameKind, str]], facts: set[str], goals: dict[str, None]
    ) -> bool:
        """Return whether a construct needs a lost function, template, fact or goal.

        :param names: the kinds and names of the lost functions and templates.
        :param facts: the templates of the lost facts.
        """
        defined: set[Name] = set()
        for mention in construct.placed.piece.mentions:
            name = mention.name
            # A construct may name its own definition, such as a recursive function.
            if mention.use is Use.DEFINED:
                defined.add(name)
            elif (name.kind, name.text) in names and name not in defined:
                return True
        for pattern in construct.patterns:
            if pattern.template in facts:
                return True
            classes = pattern.slots.get("class", frozenset()) if pattern.template == "goal" else frozenset()
            if classes and classes <= goals.keys():
                return True
        return False

    def _find_lost_names(self, lost_constructs: dict[int, Construct]) -> set[tuple[NameKind, str]]:
        """Return the functions and templates that no remaining construct defines."""
        names = _find_needed_definitions(lost_constructs.values())
        remaining_constructs = (
            construct for construct in self._usage.constructs if id(construct) not in lost_constructs
        )
        return names - _find_needed_definitions(remaining_constructs) if names else names

    def _find_lost_facts(self, lost_constructs: dict[int, Construct]) -> set[str]:
        """Return the templates whose facts no remaining construct asserts."""
        return {
            template
            for template, facts in self._usage.asserted_facts.items()
            if all(id(construct) in lost_constructs for construct, _ in facts)
            and not self._usage.is_made_elsewhere(template)
        }

    def _find_lost_goals(self, lost_constructs: dict[int, Construct]) -> list[str]:
        """Return the goal classes that rules match and only dropped constructs name."""
        classes = {
            word
            for construct in lost_constructs.values()
            for word in construct.action_literals & self._matched_classes
        }
        classes -= self._usage.configured_words  # rules may formulate goals of configured classes
        for construct in self._usage.constructs:
            if classes and id(construct) not in lost_constructs:
                classes -= construct.action_words
        return sorted(classes)

    def _find_lost_actions(self, lost_constructs: dict[int, Construct]) -> list[str]:
        """Return the actions that only dropped constructs put into plans."""
        actions = {
            action for construct in lost_constructs.values() for action in _find_planned_actions(construct)
        }
        for construct in self._usage.constructs:
            if actions and id(construct) not in lost_constructs:
                actions -= _find_planned_actions(construct)
        return sorted(actions)


def _find_needed_definitions(constructs: Iterable[Construct]) -> set[tuple[NameKind, str]]:
    return {
        (_NEEDED_KINDS[construct.keyword], construct.name)
        for construct in constructs
        if construct.keyword in _NEEDED_KINDS
    }


def _find_planned_actions(construct: Construct) -> set[str]:
    return {
        mention.name.text
        for mention in construct.placed.piece.mentions
        if mention.name.kind is NameKind.ACTION and mention.use in (Use.ASSERTED, Use.NAMED)
    }
