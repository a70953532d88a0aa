"""Matches patterns with CLIPS itself, without changing the agent's rules.

A pattern becomes a rule whose last condition calls a Python function that returns FALSE, so that the rule is
never activated. The function sees each match when it occurs, also between two firings. To get the current
matches, the rule is defined and removed again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count
from typing import TYPE_CHECKING, Final

from cxbridge.clipstext.syntax import SyntaxNode, one_line
from cxbridge.clipstext.values import FALSE, show
from cxbridge.errors import ClipsError
from cxbridge.suggestions import did_you_mean

if TYPE_CHECKING:
    from cxbridge.clipstext.values import Value
    from cxbridge.config.documents import Mark
    from cxbridge.executive.host.environment import ClipsEnvironment

_GROUPS: Final = frozenset({"and", "or", "not", "exists", "forall", "logical"})
_ABSENCE: Final = frozenset({"not", "forall"})
_NAME: Final = "cx-property-"
_LOADED: Final = "(executive-initialized)"
_NOWHERE: Final = "(executive-initialized nowhere)"
_numbers = count(1)

Values = tuple[str, ...]  # values of a pattern's variables, as CLIPS prints them


@dataclass(frozen=True, slots=True)
class ConditionPattern:
    """Conditional elements of CLIPS.

    :param where: their source position.
    """

    elements: tuple[SyntaxNode, ...]
    where: Mark

    @property
    def text(self) -> str:
        """The elements as one line of text."""
        return " ".join(one_line(node.text) for node in self.elements)

    @property
    def says_absence(self) -> bool:
        """Whether the pattern requires the absence of facts. A modify retracts a fact for a moment."""
        return any(node.head in _ABSENCE for element in self.elements for node in element.walk())

    @property
    def parts(self) -> tuple[SyntaxNode, ...]:
        """The fact patterns in the elements."""
        return tuple(_facts(self.elements))

    @property
    def templates(self) -> tuple[str, ...]:
        """The deftemplates in the elements, without duplicates."""
        return tuple(dict.fromkeys(node.head for node in self.parts))

    @property
    def variables(self) -> tuple[str, ...]:
        """The variables that are bound by a match, in order."""
        outer = [node for node in self.elements if node.head not in ("not", "forall", "exists", "or")]
        words = (word.text for node in outer for word in node.walk() if word.items is None)
        return tuple(
            dict.fromkeys(word for word in words if word[0] == "?" and len(word) > 1 and word[1] != "*")
        )


def _facts(nodes: tuple[SyntaxNode, ...]) -> Iterator[SyntaxNode]:
    for node in nodes:
        if node.head in _GROUPS:
            yield from _facts(node.arguments)
        elif node.head and node.head != "test":
            yield node


def check_names(pattern: ConditionPattern, env: ClipsEnvironment) -> None:
    """Check the deftemplates and slots of a pattern.

    :raises ConfigError: if the environment lacks one.
    """
    known: list[str] = []
    for part in pattern.parts:
        if not env.has_template(part.head):
            known = known or [str(name) for name in env.eval("(get-deftemplate-list *)")]
            hint = did_you_mean(part.head, (name.rpartition("::")[2] for name in known))
            raise pattern.where.error(f"there is no deftemplate '{part.head}': {pattern.text}", hint or None)
        slots = env.eval(f"(deftemplate-slot-names {part.head})")
        if slots == ("implied",):
            continue
        for slot in part.arguments:
            if slot.items is not None and slot.head not in slots:
                hint = did_you_mean(slot.head, slots, f"it has: {', '.join(map(str, slots))}")
                raise pattern.where.error(
                    f"deftemplate '{part.head}' has no slot '{slot.head}': {pattern.text}", hint
                )


class Probe:
    """Finds the matches of a pattern in an environment.

    :param variables: the variables to report; each match must bind all of them.
    :raises ConfigError: if CLIPS rejects the pattern.
    """

    def __init__(
        self, env: ClipsEnvironment, pattern: ConditionPattern, variables: tuple[str, ...] = ()
    ) -> None:
        self._env = env
        self._pattern = pattern
        self._name = f"{_NAME}{next(_numbers)}"
        self._name_now = f"{self._name}-now"
        self._variables = variables
        self._matched: Callable[[Values], None] = lambda _: None
        self._now: set[Values] = set()
        env.udfs.define(self._name, self._note, len(variables))
        env.udfs.define(self._name_now, self._note_now, len(variables))
        # CLIPS evaluates a test after a new `not` before it knows whether the `not` holds. Therefore a rule
        # that is never activated builds the joins first, and later rules share all of them except the last.
        self._build(f"{self._name}-joins", f"{_LOADED} {pattern.text} {_NOWHERE}")
        self._asked = f"{_LOADED} {pattern.text} {_LOADED} {self._call(self._name_now)}"

    def _note(self, *values: Value) -> Value:
        self._matched(tuple(map(show, values)))
        return FALSE

    def _note_now(self, *values: Value) -> Value:
        self._now.add(tuple(map(show, values)))
        return FALSE

    def follow(self, matched: Callable[[Values], None]) -> None:
        """Call ``matched`` with the variables' values at each match from now on.

        Do not use this for patterns with ``not``, see above.
        """
        self._matched = matched
        self._build(self._name, f"{self._pattern.text} {self._call(self._name)}")

    def now(self) -> set[Values]:
        """Return the variables' values of all current matches; empty before the agent is loaded."""
        self._now = set()
        self._build(self._name_now, self._asked)
        self._env.eval(f"(undefrule {self._name_now})")
        return self._now

    def _call(self, function: str) -> str:
        return f"(test ({' '.join((function, *self._variables))}))"

    def _build(self, name: str, condition: str) -> None:
        try:
            self._env.build_unrecorded(f"(defrule {name} {condition} =>)")
        except ClipsError as error:
            text = f"CLIPS does not take the pattern {self._pattern.text}"
            raise self._pattern.where.error(text, error.message) from None
