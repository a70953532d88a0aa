"""Matches patterns with CLIPS, without changing the agent's rules.

A pattern becomes a rule whose last condition calls a Python function that returns FALSE, so that the rule is
never activated. CLIPS calls the function at each match, even between two firings of other rules. To find the
current matches, such a rule is defined and removed again.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count
from typing import TYPE_CHECKING, Final

from cxbridge.clipstext.syntax import SyntaxNode, compact
from cxbridge.clipstext.values import FALSE, value_text
from cxbridge.errors import ClipsError
from cxbridge.suggestions import did_you_mean

if TYPE_CHECKING:
    from cxbridge.clipstext.values import Value
    from cxbridge.config.documents import Mark
    from cxbridge.executive.host.environment import ClipsEnvironment

_GROUP_HEADS: Final = frozenset({"and", "or", "not", "exists", "forall", "logical"})
_ABSENCE_HEADS: Final = frozenset({"not", "forall"})
_LOCAL_HEADS: Final = frozenset({"not", "forall", "exists", "or"})  # their variables have no value outside
_NAME_PREFIX: Final = "cx-property-"  # of the names of rules and functions
_LOADED_PATTERN: Final = "(executive-initialized)"  # matches a fact that a loaded agent has
_UNMATCHED_PATTERN: Final = "(executive-initialized nowhere)"  # matches no fact
# the code and the text of the first error in a message of CLIPS, up to the line "... ERROR:" or the end
_CLIPS_REASON: Final = re.compile(r"\[[A-Z]+\d+\].*?(?= ERROR:|$)", re.DOTALL)
# a variable: neither a wildcard `?` nor a global variable `?*name*`
_VARIABLE: Final = re.compile(r"\?[^*].*", re.DOTALL)
_numbers = count(1)  # make the names unique in the process

BoundValues = tuple[str, ...]  # values of a pattern's variables, as CLIPS prints them


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
        return " ".join(compact(node.text) for node in self.elements)

    @property
    def requires_absence(self) -> bool:
        """Whether the pattern requires the absence of facts."""
        return any(node.head in _ABSENCE_HEADS for element in self.elements for node in element.walk())

    @property
    def templates(self) -> tuple[str, ...]:
        """The deftemplates in the elements, without duplicates."""
        return tuple(dict.fromkeys(_find_templates(self.elements)))

    @property
    def variables(self) -> tuple[str, ...]:
        """The variables of single fields that a match binds, in order."""
        return tuple(dict.fromkeys(filter(_VARIABLE.fullmatch, _find_bound_words(self.elements))))


def _find_templates(nodes: tuple[SyntaxNode, ...]) -> Iterator[str]:
    for node in nodes:
        if node.head in _GROUP_HEADS:
            yield from _find_templates(node.arguments)
        elif node.head and node.head != "test":
            yield node.head


def _find_bound_words(nodes: tuple[SyntaxNode, ...]) -> Iterator[str]:
    """Yield the words of conditional elements whose variables have a value outside of the elements."""
    for node in nodes:
        if node.items is None:
            yield node.text
        elif node.head not in _LOCAL_HEADS:
            yield from _find_bound_words(node.items)


def check_templates(pattern: ConditionPattern, env: ClipsEnvironment) -> None:
    """Check the deftemplates of a pattern, since CLIPS would create an unknown deftemplate.

    :raises ConfigError: if the environment lacks a deftemplate.
    """
    for name in pattern.templates:
        if not env.has_template(name):
            full_names = map(str, env.eval("(get-deftemplate-list *)"))  # MODULE::NAME
            hint = did_you_mean(name, (full_name.rpartition("::")[2] for full_name in full_names))
            raise pattern.mark.error(f"there is no deftemplate '{name}': {pattern.text}", hint or None)


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
        # each is the name of a rule, and of the function that the rule calls at each match
        self._reporter_name = f"{_NAME_PREFIX}{next(_numbers)}"
        self._collector_name = f"{self._reporter_name}-now"
        self._variables = variables
        self._on_match: Callable[[BoundValues], None] = lambda _: None
        self._matches: set[BoundValues] = set()
        env.udfs.define(self._reporter_name, self._report_match, len(variables))
        env.udfs.define(self._collector_name, self._collect_match, len(variables))
        # CLIPS evaluates a test after a new `not` before it knows whether the `not` holds. Therefore a rule
        # without matches builds the joins first, and later rules share all its joins except the last.
        self._define_rule(
            f"{self._reporter_name}-joins", f"{_LOADED_PATTERN} {pattern.text} {_UNMATCHED_PATTERN}"
        )
        self._collector_condition = (
            f"{_LOADED_PATTERN} {pattern.text} {_LOADED_PATTERN} {self._make_test(self._collector_name)}"
        )

    def _report_match(self, *values: Value) -> Value:
        self._on_match(tuple(map(value_text, values)))
        return FALSE

    def _collect_match(self, *values: Value) -> Value:
        self._matches.add(tuple(map(value_text, values)))
        return FALSE

    def follow_matches(self, on_match: Callable[[BoundValues], None]) -> None:
        """Call ``on_match`` with the values of the variables at each match from now on.

        The pattern must not require an absence: CLIPS evaluates the test after a ``not`` even while the
        ``not`` does not hold.
        """
        self._on_match = on_match
        self._define_rule(self._reporter_name, f"{self._pattern.text} {self._make_test(self._reporter_name)}")

    def find_matches(self) -> set[BoundValues]:
        """Return the values of the variables in all current matches; empty before the agent is loaded."""
        self._matches = set()
        # CLIPS matches a new rule against all present facts at once.
        self._define_rule(self._collector_name, self._collector_condition)
        self._env.eval(f"(undefrule {self._collector_name})")
        return self._matches

    def _make_test(self, function: str) -> str:
        return f"(test ({' '.join((function, *self._variables))}))"

    def _define_rule(self, name: str, condition: str) -> None:
        """Define a rule.

        :raises ConfigError: if CLIPS rejects the pattern.
        """
        try:
            self._env.build_unrecorded(f"(defrule {name} {condition} =>)")
        except ClipsError as error:
            message = f"CLIPS rejects the pattern {self._pattern.text}"
            # without the name of the rule and the number of the condition, which users have not written
            reason = _CLIPS_REASON.search(error.message)
            hint = re.sub(r" found in CE #\d+", "", reason[0]) if reason else None
            raise self._pattern.mark.error(message, hint) from None
