"""The variables of a fired rule's condition, found by matching its facts again with CLIPS."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice, product
from typing import TYPE_CHECKING, Final

from cxbridge.clipstext.condition import CE, GroupCE, PatternCE, TestCE, patterns
from cxbridge.clipstext.values import FactRef, Value
from cxbridge.errors import ClipsError
from cxbridge_studio.agent.rule import parse_rule
from cxbridge_studio.explain.rules.matcher import Matcher
from cxbridge_studio.explain.rules.recorded_facts import rows_of

if TYPE_CHECKING:
    from cxbridge.events import FactChange
    from cxbridge_studio.explain.rules.snapshot import Snapshot

_FACT: Final = "cx-dap-fact-"
_MAX_BRANCHES: Final = 64  # alternatives of nested (or ...) multiply
_MAX_WAYS: Final = 1000  # matches of a rule that are compared with the firing


def facts_of(basis: str) -> list[int]:
    """Return the indices of the facts in a basis such as ``f-1,*,f-3``."""
    parts = (part.strip().removeprefix("f-") for part in basis.split(","))
    return [int(part) for part in parts if part.isdecimal()]


def bindings(bare: Snapshot, basis: str, fact: Callable[[int], FactChange | None]) -> dict[str, Value]:
    """Return the values of the variables in a rule's condition, by name without ``?``.

    :param bare: the rule, without facts.
    :param basis: the facts the rule fires for.
    :param fact: returns a fact by its index.
    :raises ClipsError: if a fact is unknown, or the condition cannot be matched here.
    """
    condition = parse_rule(bare.text)
    indices = facts_of(basis)
    changes = [fact(index) for index in dict.fromkeys(indices)]
    known = [change for change in changes if change is not None]
    if len(known) < len(changes):
        raise ClipsError("a fact that the rule fired for is not known any more")
    names = {pattern.template for pattern in patterns(condition.ces)}
    templates, rows = rows_of(known, {name: each for name, each in bare.templates.items() if name in names})
    with Matcher(replace(bare, templates=templates, facts=tuple(rows), all_facts=False)) as matcher:
        failure = ClipsError("the facts do not match the condition any more")
        for ces in islice(_branches(condition.ces), _MAX_BRANCHES):
            fact_patterns = [ce for ce in ces if isinstance(ce, PatternCE)]
            if len(fact_patterns) != len(indices):
                continue
            # Without tests, a condition also matches after the rule has changed its facts.
            for loose in (False, True):
                try:
                    bound_values = _bound(matcher, ces, fact_patterns, indices, loose=loose)
                except ClipsError as error:
                    failure = error  # such as a function that only the run has
                    continue
                if bound_values is not None:
                    return bound_values
    raise failure


def _branches(ces: Sequence[CE]) -> Iterator[list[PatternCE | TestCE]]:
    choices: list[list[list[PatternCE | TestCE]]] = []
    for ce in ces:
        if not isinstance(ce, GroupCE):
            choices.append([[ce]])
        elif ce.kind == "and":
            choices.append(list(islice(_branches(ce.items), _MAX_BRANCHES)))
        elif ce.kind == "or":
            each = (way for branch in ce.items for way in _branches((branch,)))
            choices.append(list(islice(each, _MAX_BRANCHES)))
    for ways in product(*choices):
        yield [ce for way in ways for ce in way]


def _bound(
    matcher: Matcher,
    ces: Sequence[PatternCE | TestCE],
    fact_patterns: Sequence[PatternCE],
    indices: Sequence[int],
    *,
    loose: bool,
) -> dict[str, Value] | None:
    """Return the variables of the match with these facts in this order, or None."""
    texts: list[str] = []
    facts: list[str] = []
    names: dict[str, None] = {}
    for ce in ces:
        if isinstance(ce, TestCE):
            texts += [] if loose else [ce.text]
            continue
        variable = ce.variable or f"{_FACT}{len(facts)}"
        text = _loose(ce) if loose else ce.text.partition(" <- ")[2] if ce.variable else ce.text
        texts.append(f"?{variable} <- {text}")
        facts.append(variable)
        names |= dict.fromkeys((variable,))
        names |= dict.fromkeys(field.name for part in ce.parts for field in part.fields if field.name)
    if not fact_patterns:
        return {}
    fact_refs = [FactRef(index) for index in indices]
    for values in matcher.note(texts, list(names), _MAX_WAYS):
        bound_values = dict(zip(names, values, strict=True))
        if [bound_values[variable] for variable in facts] == fact_refs:
            return {name: value for name, value in bound_values.items() if not name.startswith(_FACT)}
    return None


def _loose(ce: PatternCE) -> str:
    """Return a pattern that binds the same variables without any constraint."""
    parts = [
        part.write([field.binder if field.name else field.wildcard for field in part.fields])
        for part in ce.parts
    ]
    return f"({' '.join((ce.template, *parts))})"


def matching(bare: Snapshot, pattern: str, facts: Mapping[str, Sequence[FactChange]]) -> list[int]:
    """Return the indices of the facts that match a pattern.

    :param bare: a snapshot with the deftemplate.
    :param facts: the facts of that deftemplate, by its name.
    :raises ClipsError: if the text is not a pattern.
    """
    changes = [change for each in facts.values() for change in each]
    templates, rows = rows_of(changes, bare.templates)
    with Matcher(replace(bare, templates=templates, facts=tuple(rows))) as matcher:
        matches = matcher.note([f"?{_FACT}0 <- {pattern}"], [f"{_FACT}0"], len(changes) + 1)
    return list(dict.fromkeys(values[0].index for values in matches))
