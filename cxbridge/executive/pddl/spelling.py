"""Names in the spelling of their declarations. PDDL ignores case, CLIPS does not.

A name may differ from its declaration in case, and a function without arguments may lack brackets. Both get
the declared form here, so that names compare as text.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

from msgspec.structs import replace

from cxbridge.executive.pddl.ast import (
    ARITHMETIC,
    ROOT_TYPE,
    TOTAL_TIME,
    ActionSchema,
    Atom,
    Constant,
    Domain,
    Formula,
    FunctionTerm,
    NumericChange,
    Problem,
    Quantified,
    Term,
    TermComparison,
    TypedList,
    Variable,
    names_of,
)

Table = Mapping[str, str]
"""Declared forms by lower-case name."""


def spell_domain(domain: Domain, words: Iterable[str], words_of_numbers: set[str]) -> Domain:
    """Return the domain with declared spellings."""
    # a domain with one spelling of each name needs no copy of its tree
    functions = {function.name.lower() for function in domain.functions if not function.parameters}
    if not _has_two_spellings(words) and functions.isdisjoint(map(str.lower, words_of_numbers)):
        return domain
    return _Spelling(domain, domain.constants).domain(domain)


def spell_problem(
    problem: Problem, domain: Domain, words: Iterable[str], words_of_numbers: set[str]
) -> Problem:
    """Return the problem with the spellings of its declarations and the domain's."""
    functions = {
        TOTAL_TIME,
        *(function.name.lower() for function in domain.functions if not function.parameters),
    }
    if not _has_two_spellings((*words, *_names_in(domain))) and functions.isdisjoint(
        map(str.lower, words_of_numbers)
    ):
        return problem
    return _Spelling(domain, domain.constants + problem.objects).problem(problem)


def _has_two_spellings(words: Iterable[str]) -> bool:
    """Return whether two words differ only in case."""
    distinct = set(words)
    return len({word.lower() for word in distinct}) != len(distinct)


def _names_in(domain: Domain) -> Iterable[str]:
    yield from (domain.name, ROOT_TYPE)
    yield from names_of(domain.types + domain.constants)
    yield from (predicate.name for predicate in domain.predicates)
    yield from (function.name for function in domain.functions)


class _Spelling:
    def __init__(self, domain: Domain, objects: TypedList) -> None:
        self._name = domain.name
        self._types = _table((ROOT_TYPE, *names_of(domain.types)))
        self._objects = _table(names_of(objects))
        self._predicates = _table(predicate.name for predicate in domain.predicates)
        self._functions = _table((*(function.name for function in domain.functions), TOTAL_TIME))
        self._numbers = {function.name for function in domain.functions if not function.parameters} | {
            TOTAL_TIME
        }

    def domain(self, domain: Domain) -> Domain:
        return replace(
            domain,
            types=self._typed(domain.types, self._types),
            constants=self._typed(domain.constants, self._objects),
            predicates=tuple(
                self._declaration(predicate, self._predicates) for predicate in domain.predicates
            ),
            functions=tuple(self._declaration(function, self._functions) for function in domain.functions),
            actions=tuple(map(self._action, domain.actions)),
        )

    def problem(self, problem: Problem) -> Problem:
        metric = problem.metric
        if metric is not None:
            metric = (metric[0], self._number(self._term(metric[1], {})))
        return replace(
            problem,
            domain=_spelt(problem.domain, _table((self._name,))),
            objects=self._typed(problem.objects, self._objects),
            # two atoms may differ in case only
            init=tuple(dict.fromkeys(self._formula(atom, {}) for atom in problem.init)),
            init_false=tuple(self._formula(atom, {}) for atom in problem.init_false),
            numbers=tuple((self._term(call, {}), value) for call, value in problem.numbers),
            goal=self._formula(problem.goal, {}),
            metric=metric,
        )

    def _typed(self, typed: TypedList, names: Table) -> TypedList:
        return tuple(
            replace(
                group,
                names=tuple(_spelt(name, names) for name in group.names),
                types=tuple(_spelt(type_, self._types) for type_ in group.types),
            )
            for group in typed
        )

    def _declaration(self, declared: Any, names: Table) -> Any:
        name, parameters = declared.name, declared.parameters
        return replace(declared, name=_spelt(name, names), parameters=self._typed(parameters, {}))

    def _action(self, action: ActionSchema) -> ActionSchema:
        formulas = {name: getattr(action, name) for name in _FORMULAS}
        quantified = [name for formula in formulas.values() for name in _quantified_names(formula)]
        variables = _table((*names_of(action.parameters), *quantified, "duration"))
        changed = {name: formula and self._formula(formula, variables) for name, formula in formulas.items()}
        return replace(action, parameters=self._typed(action.parameters, variables), **changed)

    def _formula(self, formula: Formula, variables: Table) -> Any:
        def spell(part: Formula) -> Any:
            match part:
                case Atom(predicate=name):
                    return _renamed(part, "predicate", _spelt(name, self._predicates))
                case Quantified():
                    return replace(part, variables=self._typed(part.variables, variables))
                case TermComparison(left=left, right=right):
                    return replace(part, left=self._number(left), right=self._number(right))
                case NumericChange(target=target, amount=amount):
                    return replace(part, target=self._number(target), amount=self._number(amount))
                case _:
                    return part

        variables = variables or _table(_quantified_names(formula))
        return formula.map_terms(lambda term: self._spell_term(term, variables)).map(spell)

    def _term(self, term: Any, variables: Table) -> Any:
        if isinstance(term, FunctionTerm):
            arguments = tuple(self._term(argument, variables) for argument in term.arguments)
            term = replace(term, arguments=arguments)
        return self._spell_term(term, variables)

    def _spell_term(self, term: Term, variables: Table) -> Any:
        match term:
            case Variable(name=name):
                return _renamed(term, "name", _spelt(name, variables))
            case Constant(name=name):
                return _renamed(term, "name", _spelt(name, self._objects))
            case FunctionTerm(function=name, arguments=terms):
                if name in ARITHMETIC:
                    return replace(term, arguments=tuple(map(self._number, terms)))
                return _renamed(term, "function", _spelt(name, self._functions))

    def _number(self, term: Term) -> Term:
        """Return the term as a function term if it is a function without brackets."""
        if not isinstance(term, Constant) or term.name in self._objects.values():
            return term
        name = _spelt(term.name, self._functions)
        return FunctionTerm(name, (), term.position) if name in self._numbers else term


_FORMULAS: Final = ("duration", "condition", "effect", "conditional_breakup", "temporal_breakup")


def _quantified_names(formula: Formula | None) -> Iterator[str]:
    """Yield the variables of all quantifiers in a formula."""
    for part in () if formula is None else formula.walk():
        if isinstance(part, Quantified):
            yield from names_of(part.variables)


def _renamed(node: Any, field: str, name: str) -> Any:
    return node if getattr(node, field) == name else replace(node, **{field: name})


def _table(names: Iterable[str]) -> dict[str, str]:
    table: dict[str, str] = {}
    for name in names:
        table.setdefault(name.lower(), name)
    return table


def _spelt(name: str, table: Table) -> str:
    return table.get(name.lower(), name)
