"""Finds the variables of a fired rule's condition by matching its facts again.

CLIPS has no interface to the variables of a rule that fires. The basis of a firing names the facts that match
the condition. A separate CLIPS environment with only these facts binds the variables to the same values.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import islice, product
from typing import TYPE_CHECKING, Final

from cxbridge.clipstext.values import FactRef, Value
from cxbridge.errors import ClipsError
from cxbridge.numbers import parse_decimal
from cxbridge_studio.agent.condition import CE, GroupCE, PatternCE, TestCE
from cxbridge_studio.agent.rule import parse_rule
from cxbridge_studio.explain.rules.matcher import Matcher
from cxbridge_studio.explain.rules.recorded_facts import parse_rows

if TYPE_CHECKING:
    from cxbridge.events import FactChange
    from cxbridge_studio.explain.rules.snapshot import Snapshot

# The prefix of the variables for the facts that the condition does not bind to a variable.
_FACT_VARIABLE_PREFIX: Final = "cx-dap-fact-"
_MAX_BRANCHES: Final = 64  # limit of the tried alternatives, whose number grows exponentially with (or ...)
_MAX_MATCHES: Final = 1000  # limit of the matches that are compared with the firing, or tried for each fact


def parse_basis(basis: str) -> list[int]:
    """Return the indices of the facts in a basis such as ``f-1,*,f-3``."""
    numbers = (parse_decimal(item.strip().removeprefix("f-")) for item in basis.split(","))
    # `*` stands for a conditional element without a fact, e.g. `not`
    return [number for number in numbers if number is not None]


def find_bindings(
    snapshot: Snapshot, basis: str, find_fact: Callable[[int], FactChange | None]
) -> dict[str, Value]:
    """Return the values of the variables in a rule's condition, by their names without ``?``.

    :param snapshot: the rule, without facts.
    :param basis: the facts that the rule fires for, in the notation ``f-1,*``.
    :param find_fact: returns the fact with an index, or None if the fact is unknown.
    :raises ClipsError: if a fact is unknown, or the condition cannot be matched here.
    """
    condition = parse_rule(snapshot.text)
    indices = parse_basis(basis)
    changes = [change for index in dict.fromkeys(indices) if (change := find_fact(index)) is not None]
    if len(changes) < len(set(indices)):
        raise ClipsError(
            "a fact that the rule fired for is no longer known", hint="stop before the rule fires to see it"
        )
    templates, rows = parse_rows(changes, snapshot.templates)
    with Matcher(replace(snapshot, templates=templates, facts=tuple(rows))) as matcher:
        failure = ClipsError("the facts no longer match the condition")
        for ces in islice(_expand_alternatives(condition.ces), _MAX_BRANCHES):
            fact_patterns = [ce for ce in ces if isinstance(ce, PatternCE)]
            if len(fact_patterns) != len(indices):
                continue  # the rule fired for another alternative
            # without tests and constraints, a condition also matches facts that the rule has changed since
            for is_relaxed in (False, True):
                try:
                    bound_values = _match_variables(
                        matcher, ces, fact_patterns, indices, is_relaxed=is_relaxed
                    )
                except ClipsError as error:
                    failure = error  # e.g. about a function that only the run has
                    continue
                if bound_values is not None:
                    return bound_values
    raise failure


def _expand_alternatives(ces: Sequence[CE]) -> Iterator[list[PatternCE | TestCE]]:
    """Yield the patterns and tests for each combination of alternatives of the ``or`` elements."""
    choices: list[list[list[PatternCE | TestCE]]] = []
    for ce in ces:
        if not isinstance(ce, GroupCE):
            choices.append([[ce]])
        elif ce.kind == "and":
            choices.append(list(islice(_expand_alternatives(ce.items), _MAX_BRANCHES)))
        elif ce.kind == "or":
            alternatives = (option for branch in ce.items for option in _expand_alternatives((branch,)))
            choices.append(list(islice(alternatives, _MAX_BRANCHES)))
        # `not`, `exists` and `forall` bind no variable
    for alternative in product(*choices):
        yield [ce for choice in alternative for ce in choice]


def _match_variables(
    matcher: Matcher,
    ces: Sequence[PatternCE | TestCE],
    fact_patterns: Sequence[PatternCE],
    indices: Sequence[int],
    *,
    is_relaxed: bool,
) -> dict[str, Value] | None:
    """Return the variables of the match with these facts in this order; None without such a match.

    :param is_relaxed: whether to leave out the tests and the constraints of the slots.
    """
    if not fact_patterns:
        return {}
    texts: list[str] = []
    fact_variables: list[str] = []
    variable_names: dict[str, None] = {}  # in the order of the condition, as the editor shows them
    for ce in ces:
        if isinstance(ce, TestCE):
            texts += [] if is_relaxed else [ce.text]
            continue
        variable = ce.variable or f"{_FACT_VARIABLE_PREFIX}{len(fact_variables)}"
        texts.append(f"?{variable} <- {_strip_constraints(ce) if is_relaxed else ce.text_without_variable()}")
        fact_variables.append(variable)
        field_variables = [
            field.variable_name
            for constraint in ce.constraints
            for field in constraint.fields
            if field.variable_name
        ]
        variable_names |= dict.fromkeys((variable, *field_variables))
    fact_refs = [FactRef(index) for index in indices]
    for values in matcher.match_values(texts, list(variable_names), _MAX_MATCHES):
        bound_values = dict(zip(variable_names, values, strict=True))
        if [bound_values[variable] for variable in fact_variables] == fact_refs:
            return {
                name: value
                for name, value in bound_values.items()
                if not name.startswith(_FACT_VARIABLE_PREFIX)
            }
    return None


def _strip_constraints(ce: PatternCE) -> str:
    """Return a pattern that binds the same variables without any constraint."""
    constraints = [
        constraint.join_fields(
            [field.binder if field.variable_name else field.wildcard for field in constraint.fields]
        )
        for constraint in ce.constraints
    ]
    return f"({' '.join((ce.template, *constraints))})"


def match_pattern(snapshot: Snapshot, pattern: str, facts: Sequence[FactChange]) -> set[int]:
    """Return the indices of the facts that match a pattern.

    :param snapshot: a snapshot with the pattern's deftemplate.
    :param facts: the facts of that deftemplate.
    :raises ClipsError: if the text is not a pattern.
    """
    templates, rows = parse_rows(facts, snapshot.templates)
    with Matcher(replace(snapshot, templates=templates, facts=tuple(rows))) as matcher:
        matches = matcher.match_values(
            [f"?{_FACT_VARIABLE_PREFIX}0 <- {pattern}"],
            [f"{_FACT_VARIABLE_PREFIX}0"],
            _MAX_MATCHES * (len(facts) + 1),  # a pattern with `$?` may match a fact several times
        )
    return {fact.index for (fact,) in matches}
