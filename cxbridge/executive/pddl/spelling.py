"""Names in the spelling of their declarations, because PDDL ignores case and CLIPS does not.

The functions of this module give names their declared spelling, so that names can be compared as text.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from msgspec.structs import replace

from cxbridge.executive.pddl.ast import (
    ROOT_TYPE,
    ActionSchema,
    Atom,
    Constant,
    Domain,
    Formula,
    FunctionTerm,
    Problem,
    Term,
    TypedList,
    Variable,
    map_term,
    names_of,
)

Spellings = Mapping[str, str]
"""Declared spellings by lower-case name."""


def spell_domain(domain: Domain, words: Iterable[str]) -> Domain:
    """Return the domain with declared spellings.

    :param words: the words of the domain's text.
    """
    # a copy of the syntax tree takes time: most domains spell each name in one way, and need no copy
    if not _has_two_spellings((*words, ROOT_TYPE)):
        return domain
    return _Speller(domain, domain.constants).spell_domain(domain)


def spell_problem(problem: Problem, domain: Domain, words: Iterable[str]) -> Problem:
    """Return the problem with the spellings of the declarations in problem and domain.

    :param words: the words of the problem's text.
    """
    if not _has_two_spellings((*words, *_list_domain_names(domain))):
        return problem
    return _Speller(domain, domain.constants + problem.objects).spell_problem(problem)


def _has_two_spellings(words: Iterable[str]) -> bool:
    """Return whether two words differ only in case."""
    spellings = set(words)
    return len({spelling.lower() for spelling in spellings}) != len(spellings)


def _list_domain_names(domain: Domain) -> Iterable[str]:
    yield from (domain.name, ROOT_TYPE)
    yield from names_of(domain.types + domain.constants)
    yield from (predicate.name for predicate in domain.predicates)
    yield from (function.name for function in domain.functions)


class _Speller:
    """Gives the names of a syntax tree the spelling of their declarations."""

    def __init__(self, domain: Domain, objects: TypedList) -> None:
        self._domain_names = _make_spelling_table((domain.name,))
        self._types = _make_spelling_table((ROOT_TYPE, *names_of(domain.types)))
        self._objects = _make_spelling_table(names_of(objects))
        self._predicates = _make_spelling_table(predicate.name for predicate in domain.predicates)
        self._functions = _make_spelling_table(function.name for function in domain.functions)

    def spell_domain(self, domain: Domain) -> Domain:
        return replace(
            domain,
            types=self._spell_typed_list(domain.types, self._types),
            constants=self._spell_typed_list(domain.constants, self._objects),
            predicates=tuple(
                self._spell_declaration(predicate, self._predicates) for predicate in domain.predicates
            ),
            functions=tuple(
                self._spell_declaration(function, self._functions) for function in domain.functions
            ),
            actions=tuple(map(self._spell_action, domain.actions)),
        )

    def spell_problem(self, problem: Problem) -> Problem:
        metric = problem.metric
        if metric is not None:
            direction, term = metric
            metric = direction, map_term(term, self._spell_constant_term)
        return replace(
            problem,
            domain=_declared_spelling(problem.domain, self._domain_names),
            objects=self._spell_typed_list(problem.objects, self._objects),
            # atoms that differ in case only become equal here
            init=tuple(dict.fromkeys(self._spell_formula(atom, {}) for atom in problem.init)),
            numbers=tuple(
                (map_term(call, self._spell_constant_term), value) for call, value in problem.numbers
            ),
            goal=self._spell_formula(problem.goal, {}),
            metric=metric,
        )

    def _spell_typed_list(self, typed_list: TypedList, names: Spellings) -> TypedList:
        return tuple(
            replace(
                group,
                names=tuple(_declared_spelling(name, names) for name in group.names),
                types=tuple(_declared_spelling(type_, self._types) for type_ in group.types),
            )
            for group in typed_list
        )

    def _spell_declaration(self, declared: Any, names: Spellings) -> Any:
        return replace(
            declared,
            name=_declared_spelling(declared.name, names),
            # PDDL names the parameters of a declaration nowhere else
            parameters=self._spell_typed_list(declared.parameters, {}),
        )

    def _spell_action(self, action: ActionSchema) -> ActionSchema:
        formulas = {"duration": action.duration, "condition": action.condition, "effect": action.effect}
        quantified_names = [name for formula in formulas.values() for name in _find_quantified_names(formula)]
        variables = _make_spelling_table((*names_of(action.parameters), *quantified_names, "duration"))
        return replace(
            action,
            parameters=self._spell_typed_list(action.parameters, variables),
            **{
                name: formula and self._spell_formula(formula, variables)
                for name, formula in formulas.items()
            },
        )

    def _spell_formula(self, formula: Formula, variables: Spellings) -> Any:
        def spell(part: Formula) -> Any:
            match part:
                case Atom(predicate=name):
                    return _rename(part, "predicate", _declared_spelling(name, self._predicates))
                case _ if part.variables:
                    return replace(part, variables=self._spell_typed_list(part.variables, variables))
                case _:
                    return part

        # without an action, the only variables are those of the formula's quantifiers
        variables = variables or _make_spelling_table(_find_quantified_names(formula))
        return formula.map_terms(lambda term: self._spell_term(term, variables)).map(spell)

    def _spell_constant_term(self, term: Term) -> Any:
        """Return a term without variables in the declared spelling."""
        return self._spell_term(term, {})

    def _spell_term(self, term: Term, variables: Spellings) -> Any:
        match term:
            case Variable(name=name):
                return _rename(term, "name", _declared_spelling(name, variables))
            case Constant(name=name):
                return _rename(term, "name", _declared_spelling(name, self._objects))
            case FunctionTerm(function=name):
                return _rename(term, "function", _declared_spelling(name, self._functions))


def _find_quantified_names(formula: Formula | None) -> Iterator[str]:
    """Yield the variables of all quantifiers in a formula."""
    for part in () if formula is None else formula.walk():
        yield from names_of(part.variables)


def _rename(node: Any, field: str, name: str) -> Any:
    return node if getattr(node, field) == name else replace(node, **{field: name})


def _make_spelling_table(names: Iterable[str]) -> dict[str, str]:
    # reversed: of several spellings, the first counts
    return {name.lower(): name for name in reversed(tuple(names))}


def _declared_spelling(name: str, spellings: Spellings) -> str:
    return spellings.get(name.lower(), name)
