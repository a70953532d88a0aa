"""The semantic checks of a domain: everything declared, of the right number and type.

The texts of the errors are those of Fawkes' parser. It looks only through boolean formulas, quantifiers and
plain predicates; here times, conditional effects and numbers are looked through, too, unless
``fawkes_compat`` is set.
"""

from __future__ import annotations

from typing import Final

from cxbridge.executive.pddl.ast import (
    ActionSchema,
    And,
    Atom,
    Constant,
    Domain,
    Formula,
    FunctionTerm,
    Imply,
    Not,
    NumericChange,
    Or,
    Position,
    Quantified,
    Term,
    TermComparison,
    Timed,
    TypedList,
    Variable,
    When,
    number_of,
    pairs_of,
)
from cxbridge.executive.pddl.errors import PddlSemanticError, semantic_error

ROOT_TYPE: Final = "object"
_TYPING: Final = frozenset({"typing", "adl", "ucpop"})
_ARITHMETIC: Final = frozenset({"+", "-", "*", "/"})

Scope = dict[str, tuple[str, ...]]
"""Variables in sight, with their types; no types: any object."""


class DomainChecker:
    """Checks one domain.

    :param fawkes_compat: check just as Fawkes' parser does, see docs/pddl.md.
    """

    def __init__(self, domain: Domain, *, fawkes_compat: bool = False) -> None:
        self._domain = domain
        self._compat = fawkes_compat
        self._typed = not _TYPING.isdisjoint(domain.requirements)
        self._supers: dict[str, set[str]] = {}
        for name, super_type in pairs_of(domain.types):
            self._supers.setdefault(name, set()).add(super_type or ROOT_TYPE)
        self._section = "(:constants ...)"  # declares what is unknown
        self._constants: Scope = {}
        for group in domain.constants:
            for name in group.names:
                self._constants[name] = self._constants.get(name, ()) + group.types
        self._predicates = {predicate.name: predicate for predicate in domain.predicates}
        self._functions = {function.name: function for function in domain.functions}

    def check(self) -> None:
        """Check everything.

        :raises PddlSemanticError: for the first thing that makes no sense.
        """
        domain = self._domain
        declared: list[TypedList] = [domain.types, domain.constants]
        declared += [predicate.parameters for predicate in domain.predicates]
        declared += [function.parameters for function in domain.functions]
        declared += [action.parameters for action in domain.actions]
        if not self._typed:
            for typed in declared:
                self._refuse_types(typed)
        if not self._compat:
            self._refuse_all_twins()
            for typed in declared[1:] if self._typed else ():
                self._parameter_types(typed)
        for action in domain.actions:
            self._action(action)

    def check_objects(self, objects: TypedList) -> None:
        """Check the types of a problem's objects; what is checked afterwards belongs to the problem.

        :raises PddlSemanticError: when one is not declared.
        """
        self._section = "(:objects ...) of the problem"
        self._check_types(objects)

    def check_formula(self, formula: Formula) -> None:
        """Check a formula without parameters, such as a goal.

        :raises PddlSemanticError: for the first thing that makes no sense.
        """
        self._formula(formula, {})

    def _refuse_all_twins(self) -> None:
        domain = self._domain
        self._refuse_twins("predicate", [(each.name, each.position) for each in domain.predicates])
        self._refuse_twins("function", [(each.name, each.position) for each in domain.functions])
        self._refuse_twins("action", [(each.name, each.position) for each in domain.actions])
        for action in domain.actions:
            names = [(name, group.position) for group in action.parameters for name in group.names]
            self._refuse_twins(f"parameter of action {action.name}", names)

    def _refuse_twins(self, what: str, named: list[tuple[str, Position]]) -> None:
        """Refuse two of one name: their facts would have the same ids."""
        first: dict[str, Position] = {}
        for name, position in named:
            if name in first:
                raise self._error(
                    f"there is a second {what} {name}",
                    position,
                    f"the first is in line {first[name].line}: rename or remove one",
                )
            first[name] = position

    def _error(self, message: str, position: Position, hint: str | None = None) -> PddlSemanticError:
        return semantic_error(message, position, self._domain.file, hint)

    def _check_types(self, typed: TypedList) -> None:
        """Refuse types that are not declared; without typing, all types."""
        if self._typed:
            self._parameter_types(typed)
        else:
            self._refuse_types(typed)

    def _refuse_types(self, typed: TypedList) -> None:
        for group in typed:
            if group.types:
                raise self._error(
                    "Requirement typing disabled, unexpected type found.",
                    group.position,
                    "add :typing to (:requirements ...)",
                )

    def _action(self, action: ActionSchema) -> None:
        if self._typed:
            self._parameter_types(action.parameters)
        scope = {name: group.types for group in action.parameters for name in group.names}
        if action.duration is not None and not self._compat:
            self._formula(action.duration, {**scope, "duration": ()})
        if action.durative:
            scope = {"duration": (), **scope}
        for formula in (action.condition, action.effect):
            if formula is not None:
                self._formula(formula, scope)

    def _parameter_types(self, parameters: TypedList) -> None:
        known = {type_ for pair in pairs_of(self._domain.types) for type_ in pair if type_}
        if not self._compat:
            known.add(ROOT_TYPE)
        for group in parameters:
            if not group.types and self._compat:
                raise self._error("Missing type.", group.position)
            for type_ in group.types:
                if type_ not in known:
                    raise self._error(
                        f"Unknown type: {group.names[0]} - {type_}",
                        group.position,
                        "declare it in (:types ...)",
                    )

    # ---- formulas

    def _formula(self, formula: Formula, scope: Scope) -> None:
        match formula:
            case Atom():
                self._atom(formula, scope)
            case And(parts=parts) | Or(parts=parts):
                for part in parts:
                    self._formula(part, scope)
            case Not(part=part):
                self._formula(part, scope)
            case Quantified():
                self._quantified(formula, scope)
            case _ if self._compat:
                return  # Fawkes looks no further
            case Timed(part=part):
                self._formula(part, scope)
            case Imply(condition=first, consequence=second) | When(condition=first, effect=second):
                self._formula(first, scope)
                self._formula(second, scope)
            case TermComparison(left=left, right=right) | NumericChange(target=left, amount=right):
                self._number(left, scope)
                self._number(right, scope)

    def _quantified(self, formula: Quantified, scope: Scope) -> None:
        if not self._compat:
            self._check_types(formula.variables)
        bound = {name: group.types for group in formula.variables for name in group.names}
        self._formula(formula.part, {**scope, **bound})

    def _atom(self, atom: Atom, scope: Scope) -> None:
        predicate = self._predicates.get(atom.predicate)
        if predicate is None:
            raise self._error(
                f"Unknown predicate: {atom.predicate}", atom.position, "declare it in (:predicates ...)"
            )
        expected = [group.types for group in predicate.parameters for _ in group.names]
        if len(expected) != len(atom.arguments):
            raise self._error(
                "Predicate argument length missmatch,"
                f" expected {len(expected)} but got {len(atom.arguments)}",
                atom.position,
                f"({atom.predicate}) is declared in line {predicate.position.line}",
            )
        for index, (argument, types) in enumerate(zip(atom.arguments, expected, strict=True)):
            given = self._types_of(argument, scope)
            if self._typed and not self._fits(argument, given, types):
                raise self._error(
                    f"Type missmatch: Argument {index} of {atom.predicate} expects {_either(types)}"
                    f" but got {_either(given)}",
                    argument.position,
                )

    def _types_of(self, term: Term, scope: Scope) -> tuple[str, ...]:
        if isinstance(term, FunctionTerm):
            raise self._error("Unexpected nested predicate.", term.position)
        known = scope if isinstance(term, Variable) else self._constants
        if term.name in known:
            return known[term.name]
        if isinstance(term, Variable):
            raise self._error(
                f"Unknown Parameter ?{term.name}", term.position, "declare it in :parameters of the action"
            )
        raise self._error(
            f"Unknown constant {term.name}",
            term.position,
            f"declare it in {self._section}, or write ?{term.name} for the parameter"
            if term.name in scope
            else f"declare it in {self._section}",
        )

    def _fits(self, term: Term, given: tuple[str, ...], expected: tuple[str, ...]) -> bool:
        if not expected or not given:
            return not expected or ROOT_TYPE in expected
        fits = [any(self._is_subtype(each, wanted) for wanted in expected) for each in given]
        # A constant is of all its types at once, a variable of one of them.
        return any(fits) if isinstance(term, Constant) else all(fits)

    def _is_subtype(self, type_: str, wanted: str) -> bool:
        seen: set[str] = set()
        queue = [type_]
        while queue:
            each = queue.pop()
            if each == wanted:
                return True
            if each not in seen:
                seen.add(each)
                queue += self._supers.get(each, ())
        return wanted == ROOT_TYPE

    def _number(self, term: Term, scope: Scope) -> None:
        """Check a side of a comparison, or of a change of a number."""
        if isinstance(term, FunctionTerm):
            function = self._functions.get(term.function)
            if function is None and term.function not in _ARITHMETIC:
                raise self._error(
                    f"Unknown function: {term.function}", term.position, "declare it in (:functions ...)"
                )
            if function is not None:
                expected = sum(len(group.names) for group in function.parameters)
                if expected != len(term.arguments):
                    raise self._error(
                        "Function argument length missmatch,"
                        f" expected {expected} but got {len(term.arguments)}",
                        term.position,
                    )
            for argument in term.arguments:
                self._number(argument, scope)
        elif not (isinstance(term, Constant) and number_of(term.name) is not None):
            self._types_of(term, scope)


def _either(types: tuple[str, ...]) -> str:
    if len(types) == 1:
        return types[0]
    return f"(either {' '.join(types)})" if types else ROOT_TYPE
