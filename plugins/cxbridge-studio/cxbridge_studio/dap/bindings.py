"""Finds the variables of a fired rule's condition by matching its facts again with CLIPS.

CLIPS has no interface to the variables of a rule that fires. The basis of the firing names the facts, so an
isolated environment with these facts alone binds the same variables.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice, product
from typing import TYPE_CHECKING, Final

from cxbridge.clipstext.values import FactRef, Value
from cxbridge.errors import ClipsError
from cxbridge_studio.agent.condition import CE, GroupCE, PatternCE, TestCE, patterns
from cxbridge_studio.agent.rule import parse_rule
from cxbridge_studio.explain.rules.matcher import Matcher
from cxbridge_studio.explain.rules.recorded_facts import parse_rows

if TYPE_CHECKING:
    from cxbridge.events import FactChange
    from cxbridge_studio.explain.rules.snapshot import Snapshot

_FACT: Final = "cx-dap-fact-"  # the start of our names for facts that the condition does not name
_MAX_BRANCHES: Final = 64  # limit of the alternatives of nested (or ...), which multiply
_MAX_MATCHES: Final = 1000  # limit of the matches of a rule that are compared with the firing


def indices_in(basis: str) -> list[int]:
    """Return the indices of the facts in a basis such as ``f-1,*,f-3``."""
    items = (item.strip().removeprefix("f-") for item in basis.split(","))
    return [int(item) for item in items if item.isdecimal()]  # `*` stands for a CE without a fact


def bindings(snapshot: Snapshot, basis: str, fact: Callable[[int], FactChange | None]) -> dict[str, Value]:
    """Return the values of the variables in a rule's condition, by name without ``?``.

    :param snapshot: the rule, without facts.
    :param basis: the facts that the rule fires for, in the notation ``f-1,*``.
    :param fact: returns a fact by its index; None if it is unknown.
    :raises ClipsError: if a fact is unknown, or the condition cannot be matched here.
    """
    condition = parse_rule(snapshot.text)
    indices = indices_in(basis)
    changes = [change for index in dict.fromkeys(indices) if (change := fact(index)) is not None]
    if len(changes) < len(set(indices)):
        raise ClipsError("a fact that the rule fired for is not known any more")
    names = {pattern.template for pattern in patterns(condition.ces)}
    templates_of_rule = {name: template for name, template in snapshot.templates.items() if name in names}
    templates, rows = parse_rows(changes, templates_of_rule)
    with Matcher(replace(snapshot, templates=templates, facts=tuple(rows), needs_all_facts=False)) as matcher:
        failure = ClipsError("the facts do not match the condition any more")
        for ces in islice(_branches(condition.ces), _MAX_BRANCHES):
            fact_patterns = [ce for ce in ces if isinstance(ce, PatternCE)]
            if len(fact_patterns) != len(indices):
                continue  # the rule fired for another alternative
            # Without tests, a condition also matches after the rule has changed its facts.
            for is_loose in (False, True):
                try:
                    bound_values = _bound_variables(matcher, ces, fact_patterns, indices, is_loose=is_loose)
                except ClipsError as error:
                    failure = error  # such as a function that only the run has
                    continue
                if bound_values is not None:
                    return bound_values
    raise failure


def _branches(ces: Sequence[CE]) -> Iterator[list[PatternCE | TestCE]]:
    """Yield the patterns and tests of each alternative of the ``or`` CEs."""
    choices: list[list[list[PatternCE | TestCE]]] = []
    for ce in ces:
        if not isinstance(ce, GroupCE):
            choices.append([[ce]])
        elif ce.kind == "and":
            choices.append(list(islice(_branches(ce.items), _MAX_BRANCHES)))
        elif ce.kind == "or":
            alternatives = (ces for branch in ce.items for ces in _branches((branch,)))
            choices.append(list(islice(alternatives, _MAX_BRANCHES)))
        # `not`, `exists` and `forall` bind no variable.
    for alternative in product(*choices):
        yield [ce for choice in alternative for ce in choice]


def _bound_variables(
    matcher: Matcher,
    ces: Sequence[PatternCE | TestCE],
    fact_patterns: Sequence[PatternCE],
    indices: Sequence[int],
    *,
    is_loose: bool,
) -> dict[str, Value] | None:
    """Return the variables of the match with these facts in this order, or None.

    :param is_loose: whether to leave out the tests and the constraints of the slots.
    """
    if not fact_patterns:
        return {}
    texts: list[str] = []
    facts: list[str] = []
    names: dict[str, None] = {}  # in the order of the condition, as the editor shows them
    for ce in ces:
        if isinstance(ce, TestCE):
            texts += [] if is_loose else [ce.text]
            continue
        variable = ce.variable or f"{_FACT}{len(facts)}"
        texts.append(f"?{variable} <- {_without_constraints(ce) if is_loose else ce.text_without_variable()}")
        facts.append(variable)
        names |= dict.fromkeys((variable,))
        names |= dict.fromkeys(field.name for part in ce.parts for field in part.fields if field.name)
    fact_refs = [FactRef(index) for index in indices]
    for values in matcher.match_values(texts, list(names), _MAX_MATCHES):
        bound_values = dict(zip(names, values, strict=True))
        if [bound_values[variable] for variable in facts] == fact_refs:
            return {name: value for name, value in bound_values.items() if not name.startswith(_FACT)}
    return None


def _without_constraints(ce: PatternCE) -> str:
    """Return a pattern that binds the same variables without any constraint."""
    constraints = [
        constraint.join_fields(
            [field.binder if field.name else field.wildcard for field in constraint.fields]
        )
        for constraint in ce.parts
    ]
    return f"({' '.join((ce.template, *constraints))})"


def indices_of_matches(
    snapshot: Snapshot, pattern: str, facts: Mapping[str, Sequence[FactChange]]
) -> list[int]:
    """Return the indices of the facts that match a pattern.

    :param snapshot: a snapshot with the deftemplate.
    :param facts: the facts of that deftemplate, by its name.
    :raises ClipsError: if the text is not a pattern.
    """
    changes = [change for group in facts.values() for change in group]
    templates, rows = parse_rows(changes, snapshot.templates)
    with Matcher(replace(snapshot, templates=templates, facts=tuple(rows))) as matcher:
        matches = matcher.match_values([f"?{_FACT}0 <- {pattern}"], [f"{_FACT}0"], len(changes) + 1)
    return list(dict.fromkeys(fact.index for (fact,) in matches))
