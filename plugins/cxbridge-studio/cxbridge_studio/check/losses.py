"""The consequences of dropped constructs: constructs that need them, and goals and actions only they make."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Final

from cxbridge_studio.agent.names import Name, NameKind, Use
from cxbridge_studio.check.usage import Construct, Usage

_LISTED: Final = 5  # maximum number of names in a message
_NEEDS: Final = {
    "deffunction": NameKind.FUNCTION,
    "defgeneric": NameKind.FUNCTION,
    "deftemplate": NameKind.TEMPLATE,
}
_MAKES: Final = (Use.ASSERTED, Use.NAMED)


@dataclass
class Losses:
    """The losses caused by dropped constructs.

    :param constructs: further constructs that depend on them.
    :param goals: goal classes that nothing else formulates.
    :param actions: actions that nothing else plans.
    """

    constructs: list[str] = field(default_factory=list)
    goals: list[str] = field(default_factory=list)
    actions: list[str] = field(default_factory=list)

    def __bool__(self) -> bool:
        return bool(self.constructs or self.goals or self.actions)

    def __str__(self) -> str:
        if not self:
            return ""
        parts = [
            _some(self.constructs, ""),
            _some(self.goals, "goals of class "),
            _some(self.actions, "the action "),
        ]
        return f"lost with it: {', '.join(filter(None, parts))}"


def _some(names: list[str], prefix: str) -> str:
    """Return the first names, and the number of the remaining ones."""
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return ", ".join(f"{prefix}{name}" for name in names[:_LISTED]) + more


class LossFinder:
    """Finder of the losses caused by dropped constructs.

    :param is_of_core: returns whether a file belongs to the core, whose constructs are never lost.
    """

    def __init__(self, usage: Usage, is_of_core: Callable[[str], bool]) -> None:
        self._usage = usage
        self._own = [each for each in usage.constructs if not is_of_core(each.file.path)]
        self._classes = usage.model.names(NameKind.GOAL_CLASS, Use.MATCHED)

    def swallowed(self, file: str, start: int) -> Losses:
        """Return the losses of an unclosed construct, including all constructs after it."""
        dropped = [
            each for each in self._usage.constructs if each.file.path == file and each.placed.start >= start
        ]
        lost = self.of(dropped)
        lost.constructs[:0] = [each.name for each in dropped[1:] if each.name]
        return lost

    def of(self, dropped: Iterable[Construct]) -> Losses:
        first = list(dropped)
        dead = {id(each): each for each in first}
        goals: dict[str, None] = {}
        grows = True
        # LossFinder cause further losses: repeat until nothing is added.
        while grows:
            previous_sizes = len(dead), len(goals)
            goals |= dict.fromkeys(self._goals_of(dead))
            facts, gone = self._facts_of(dead), self._names_of(dead)
            for construct in self._own:
                if id(construct) not in dead and self._dies(construct, gone, facts, goals):
                    dead[id(construct)] = construct
            grows = previous_sizes != (len(dead), len(goals))
        names = {id(each) for each in first}
        anonymous_constructs = [
            each for each in self._usage.constructs if id(each) in dead and id(each) not in names
        ]
        return Losses([each.name for each in anonymous_constructs], list(goals), self._actions_of(dead))

    def _dies(
        self, construct: Construct, names: set[tuple[NameKind, str]], facts: set[str], goals: dict[str, None]
    ) -> bool:
        """Return whether a construct needs a lost function, template, fact or goal."""
        defined: set[Name] = set()
        for mention in construct.placed.piece.mentions:
            name = mention.name
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

    def _names_of(self, dead: dict[int, Construct]) -> set[tuple[NameKind, str]]:
        """Return the functions and templates that no remaining construct defines."""
        gone = {(_NEEDS[each.keyword], each.name) for each in dead.values() if each.keyword in _NEEDS}
        for each in self._usage.constructs if gone else ():
            if each.keyword in _NEEDS and id(each) not in dead:
                gone.discard((_NEEDS[each.keyword], each.name))
        return gone

    def _facts_of(self, dead: dict[int, Construct]) -> set[str]:
        """Return the templates whose facts no remaining construct asserts."""
        return {
            template
            for template, makers in self._usage.made.items()
            if all(id(construct) in dead for construct, _ in makers)
            and not self._usage.is_made_elsewhere(template)
        }

    def _goals_of(self, dead: dict[int, Construct]) -> list[str]:
        lost = {word for each in dead.values() for word in each.symbols & self._classes}
        lost -= self._usage.others
        for construct in self._usage.constructs:
            if lost and id(construct) not in dead:
                lost -= construct.words
        return sorted(lost)

    def _actions_of(self, dead: dict[int, Construct]) -> list[str]:
        asserted_templates = set[str]()
        for each in dead.values():
            asserted_templates |= _planned(each)
        for construct in self._usage.constructs:
            if asserted_templates and id(construct) not in dead:
                asserted_templates -= _planned(construct)
        return sorted(asserted_templates)


def _planned(construct: Construct) -> set[str]:
    return {
        mention.name.text
        for mention in construct.placed.piece.mentions
        if mention.name.kind is NameKind.ACTION and mention.use in _MAKES
    }
