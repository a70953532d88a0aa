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
_NAME: Final = "cx-property-"  # prefix of the names of rules and functions
_LOADED: Final = "(executive-initialized)"  # matches the fact of a loaded agent
_NEVER: Final = "(executive-initialized nowhere)"  # matches no fact
_numbers = count(1)  # numbers that make the names unique in the process

Values = tuple[str, ...]  # values of a pattern's variables, as CLIPS prints them


@dataclass(frozen=True, slots=True)
class ConditionPattern:
    """Conditional elements of CLIPS.

    :param mark: the place of the elements in the source.
    """

    elements: tuple[SyntaxNode, ...]
    mark: Mark

    @property
    def text(self) -> str:
        """The elements as one line of text."""
        return " ".join(one_line(node.text) for node in self.elements)

    @property
    def requires_absence(self) -> bool:
        """Whether the pattern requires the absence of facts."""
        return any(node.head in _ABSENCE for element in self.elements for node in element.walk())

    @property
    def fact_patterns(self) -> tuple[SyntaxNode, ...]:
        """The patterns of facts in the elements."""
        return tuple(_fact_patterns(self.elements))

    @property
    def templates(self) -> tuple[str, ...]:
        """The deftemplates in the elements, without duplicates."""
        return tuple(dict.fromkeys(node.head for node in self.fact_patterns))

    @property
    def variables(self) -> tuple[str, ...]:
        """The variables that a match binds, in order."""
        # Variables within `not`, `forall`, `exists` and `or` have no value outside of them.
        outer = [node for node in self.elements if node.head not in ("not", "forall", "exists", "or")]
        words = (word.text for node in outer for word in node.walk() if word.items is None)
        return tuple(
            dict.fromkeys(word for word in words if word[0] == "?" and len(word) > 1 and word[1] != "*")
        )


def _fact_patterns(nodes: tuple[SyntaxNode, ...]) -> Iterator[SyntaxNode]:
    for node in nodes:
        if node.head in _GROUPS:
            yield from _fact_patterns(node.arguments)
        elif node.head and node.head != "test":
            yield node


def check_names(pattern: ConditionPattern, env: ClipsEnvironment) -> None:
    """Check the deftemplates and slots of a pattern.

    :raises ConfigError: if the environment lacks a deftemplate or a slot.
    """
    for fact in pattern.fact_patterns:
        if not env.has_template(fact.head):
            templates = (str(name).rpartition("::")[2] for name in env.eval("(get-deftemplate-list *)"))
            hint = did_you_mean(fact.head, templates)
            raise pattern.mark.error(f"there is no deftemplate '{fact.head}': {pattern.text}", hint or None)
        slots = env.eval(f"(deftemplate-slot-names {fact.head})")
        if slots == ("implied",):  # an ordered fact
            continue
        for slot in fact.arguments:
            if slot.items is not None and slot.head not in slots:
                hint = did_you_mean(slot.head, slots, f"it has: {', '.join(map(str, slots))}")
                raise pattern.mark.error(
                    f"deftemplate '{fact.head}' has no slot '{slot.head}': {pattern.text}", hint
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
        self._matches: set[Values] = set()
        env.udfs.define(self._name, self._note, len(variables))
        env.udfs.define(self._name_now, self._collect, len(variables))
        # CLIPS evaluates a test after a new `not` before it knows whether the `not` holds. Therefore a rule
        # that is never activated builds the joins first, and later rules share all of them except the last.
        self._build(f"{self._name}-joins", f"{_LOADED} {pattern.text} {_NEVER}")
        self._condition_now = f"{_LOADED} {pattern.text} {_LOADED} {self._call(self._name_now)}"

    def _note(self, *values: Value) -> Value:
        self._matched(tuple(map(show, values)))
        return FALSE

    def _collect(self, *values: Value) -> Value:
        self._matches.add(tuple(map(show, values)))
        return FALSE

    def follow(self, matched: Callable[[Values], None]) -> None:
        """Call ``matched`` with the variables' values at each match from now on.

        Not for patterns with ``not``, whose test CLIPS also evaluates while the ``not`` does not hold.
        """
        self._matched = matched
        self._build(self._name, f"{self._pattern.text} {self._call(self._name)}")

    def now(self) -> set[Values]:
        """Return the variables' values of all current matches; empty before the agent is loaded."""
        self._matches = set()
        # A new rule is matched against all present facts at once.
        self._build(self._name_now, self._condition_now)
        self._env.eval(f"(undefrule {self._name_now})")
        return self._matches

    def _call(self, function: str) -> str:
        return f"(test ({' '.join((function, *self._variables))}))"

    def _build(self, name: str, condition: str) -> None:
        """Define a rule.

        :raises ConfigError: if CLIPS rejects the pattern.
        """
        try:
            self._env.build_unrecorded(f"(defrule {name} {condition} =>)")
        except ClipsError as error:
            text = f"CLIPS does not take the pattern {self._pattern.text}"
            raise self._pattern.mark.error(text, error.message) from None
