"""Semantic checks of domains and problems: declarations, types, numbers of arguments.

An error that Fawkes' parser finds, too, has Fawkes' text and spelling ("missmatch"). Fawkes checks only
boolean formulas, quantifiers and atoms. The checks here include timed formulas, conditional effects and
numbers, unless ``fawkes_compat`` is set.
"""

from __future__ import annotations

from graphlib import CycleError, TopologicalSorter
from typing import Final

from cxbridge.executive.pddl.ast import (
    ARITHMETIC,
    ROOT_TYPE,
    TOTAL_TIME,
    ActionSchema,
    And,
    Atom,
    Constant,
    Domain,
    Formula,
    FunctionTerm,
    Not,
    Or,
    Position,
    Problem,
    Quantified,
    Term,
    TermComparison,
    TypedList,
    Variable,
    number_of,
    pairs_of,
)
from cxbridge.executive.pddl.errors import PddlSemanticError, Warn, semantic_error
from cxbridge.executive.pddl.types import TypeHierarchy
from cxbridge.executive.pddl.unsupported import unsupported_formula, unsupported_texts
from cxbridge.suggestions import did_you_mean

# The formulas whose parts Fawkes checks.
_CHECKED_BY_FAWKES: Final = (Atom, And, Or, Not, Quantified)

Scope = dict[str, tuple[str, ...]]
"""The types of visible variables or of constants, by name; without types a name may be any object."""


class DomainChecker:
    """Checks one domain.

    :param fawkes_compat: check only as much as Fawkes' parser, see docs/evidence/planning.md.
    :param warn: receives mistakes that do not prevent the use of the domain.
    """

    def __init__(
        self,
        domain: Domain,
        *,
        fawkes_compat: bool = False,
        warn: Warn | None = None,
    ) -> None:
        self._domain = domain
        self._fawkes_compat = fawkes_compat
        self._warn = warn
        self._has_types = domain.requires_typing or (not fawkes_compat and domain.is_typed)
        self._hierarchy = TypeHierarchy(domain.types)
        # the section in which an unknown name can be declared, for hints
        self._declaring_section = "(:constants ...)"
        self._constants: Scope = {}
        for group in domain.constants:
            for name in group.names:  # a constant that is declared with two types has both types
                self._constants[name] = self._constants.get(name, ()) + group.types
        self._predicates = {predicate.name: predicate for predicate in domain.predicates}
        self._functions = {function.name: function for function in domain.functions}

    def check(self) -> None:
        """Check the whole domain.

        :raises PddlSemanticError: for the first mistake.
        """
        self._check_typing_requirement()
        if not self._fawkes_compat:
            self._refuse_duplicates()
            self._refuse_cyclic_types()
            for typed_list in self._domain.typed_lists[1:]:  # the first list declares the types themselves
                self._check_types(typed_list)
        for action in self._domain.actions:
            self._check_action(action)

    def check_objects(self, objects: TypedList) -> None:
        """Check the types of a problem's objects. The hints of later errors name the problem's objects.

        :raises PddlSemanticError: if a type is not declared.
        """
        self._declaring_section = "(:objects ...) of the problem"
        self._check_types(objects)

    def check_formula(self, formula: Formula) -> None:
        """Check a formula without free variables, such as a goal.

        :raises PddlSemanticError: for the first mistake.
        """
        self._check_formula(formula, {})

    def check_metric(self, term: Term) -> None:
        """Check the term of a metric, in which ``total-time`` is permitted, too.

        :raises PddlSemanticError: for the first mistake.
        """
        if not (isinstance(term, FunctionTerm) and term.function in (TOTAL_TIME, *ARITHMETIC)):
            self._check_term(term, {})
            return
        for argument in term.arguments:
            self.check_metric(argument)

    def _refuse_duplicates(self) -> None:
        """Refuse names that are declared twice, because their facts would have the same ids."""
        domain = self._domain
        # the kind as a noun, the name and the position of each declaration
        declarations: list[tuple[str, str, Position]] = [
            *(("predicate", predicate.name, predicate.position) for predicate in domain.predicates),
            *(("function", function.name, function.position) for function in domain.functions),
            *(("action", action.name, action.position) for action in domain.actions),
            *(
                (f"parameter of action {action.name}", name, group.position)
                for action in domain.actions
                for group in action.parameters
                for name in group.names
            ),
        ]
        first_positions: dict[tuple[str, str], Position] = {}
        for noun, name, position in declarations:
            if (noun, name) in first_positions:
                raise self._error(
                    f"there is a second {noun} {name}",
                    position,
                    f"the first is in line {first_positions[noun, name].line}: rename or remove one",
                )
            first_positions[noun, name] = position

    def _error(self, message: str, position: Position, hint: str | None = None) -> PddlSemanticError:
        return semantic_error(message, position, self._domain.file, hint)

    def warn(self, message: str, position: Position, hint: str | None = None) -> None:
        """Warn about a mistake that does not prevent the use of the text."""
        if self._warn is not None:
            self._warn(self._error(message, position, hint))

    def _check_typing_requirement(self) -> None:
        """Warn about types without the requirement ``:typing``; with ``fawkes_compat``, refuse them."""
        positions = (group.position for groups in self._domain.typed_lists for group in groups if group.types)
        position, hint = min(positions, default=None), "add :typing to (:requirements ...)"
        if position is None or self._domain.requires_typing:
            return
        if self._fawkes_compat:
            raise self._error("Requirement typing disabled, unexpected type found.", position, hint)
        self.warn("there are types, but the requirements have no :typing", position, hint)

    def _refuse_cyclic_types(self) -> None:
        """Refuse types that are supertypes of themselves."""
        # `object` is the root of all types, even if a domain declares a supertype of it
        parents = {
            name: types - {ROOT_TYPE} for name, types in self._hierarchy.parents.items() if name != ROOT_TYPE
        }
        try:
            TopologicalSorter(parents).prepare()
        except CycleError as error:
            _text, cycle = error.args
            for group in self._domain.types:
                for name in sorted({*cycle}.intersection(group.names)):
                    raise self._error(
                        f"the type {name} is a subtype of itself", group.position, "remove the cycle of types"
                    ) from None

    def _check_action(self, action: ActionSchema) -> None:
        if self._has_types:
            self._check_types(action.parameters)
        scope = _scope_of(action.parameters)
        if action.duration is not None and not self._fawkes_compat:
            self._check_formula(action.duration, {**scope, "duration": ()})
        if action.is_durative:  # here, a parameter named ?duration hides the predefined variable
            scope = {"duration": (), **scope}
        for formula in (action.condition, action.effect):
            if formula is not None:
                self._check_formula(formula, scope)

    def _check_types(self, parameters: TypedList) -> None:
        known_types = {type_ for pair in pairs_of(self._domain.types) for type_ in pair if type_}
        if not self._fawkes_compat:  # Fawkes' parser knows declared types only
            known_types.add(ROOT_TYPE)
        for group in parameters:
            if not group.types and self._fawkes_compat:
                raise self._error("Missing type.", group.position)
            for type_ in group.types:
                if type_ not in known_types:
                    raise self._error(
                        f"Unknown type: {group.names[0]} - {type_}",
                        group.position,
                        did_you_mean(type_, known_types, "declare it in (:types ...)"),
                    )

    def _check_formula(self, formula: Formula, scope: Scope) -> None:
        if self._fawkes_compat and not isinstance(formula, _CHECKED_BY_FAWKES):
            return
        if isinstance(formula, Atom):
            self._check_atom(formula, scope)
            return
        if formula.variables:
            if not self._fawkes_compat:
                self._check_types(formula.variables)
            scope = scope | _scope_of(formula.variables)
        for term in formula.terms:
            self._check_term(term, scope)
        for part in formula.children:
            self._check_formula(part, scope)

    def _check_atom(self, atom: Atom, scope: Scope) -> None:
        predicate = self._predicates.get(atom.predicate)
        if predicate is None:
            self._refuse_unsupported(unsupported_formula(atom.predicate), atom.position)
            raise self._error(
                f"Unknown predicate: {atom.predicate}",
                atom.position,
                did_you_mean(atom.predicate, self._predicates, "declare it in (:predicates ...)"),
            )
        parameter_types = [group.types for group in predicate.parameters for _ in group.names]
        if len(parameter_types) != len(atom.arguments):
            raise self._error(
                "Predicate argument length missmatch,"
                f" expected {len(parameter_types)} but got {len(atom.arguments)}",
                atom.position,
                f"({atom.predicate}) is declared in line {predicate.position.line} of the domain",
            )
        for index, (argument, expected_types) in enumerate(zip(atom.arguments, parameter_types, strict=True)):
            actual_types = self._find_types(argument, scope)
            if self._has_types and not self._accepts(argument, actual_types, expected_types):
                message = (
                    f"Type missmatch: Argument {index} of {atom.predicate}"
                    f" expects {_format_types(expected_types)} but got {_format_types(actual_types)}"
                )
                if actual_types or self._fawkes_compat:
                    raise self._error(message, argument.position)
                # a parameter without type accepts any object; for objects of a wrong type the predicate is
                # false
                self.warn(message, argument.position)

    def _refuse_unsupported(self, name: str, position: Position) -> None:
        """Refuse an unsupported part of PDDL by its name, unless ``fawkes_compat`` is set.

        :param name: empty for a part that is not known to be unsupported, which is not refused here.
        """
        if name and not self._fawkes_compat:
            message, hint = unsupported_texts(name)
            raise self._error(message, position, hint)

    def _find_types(self, term: Term, scope: Scope) -> tuple[str, ...]:
        """Return the types of a declared variable or constant; no types: the term may be any object."""
        if isinstance(term, FunctionTerm):
            raise self._error("Unexpected nested predicate.", term.position)
        types_by_name = scope if isinstance(term, Variable) else self._constants
        if term.name in types_by_name:
            return types_by_name[term.name]
        if isinstance(term, Variable):
            raise self._error(
                f"Unknown Parameter ?{term.name}",
                term.position,
                "declare it in :parameters of the action, or in a quantifier",
            )
        raise self._error(
            f"Unknown constant {term.name}",
            term.position,
            f"declare it in {self._declaring_section}, or write ?{term.name} for the variable"
            if term.name in scope
            else f"declare it in {self._declaring_section}",
        )

    def _accepts(self, term: Term, actual_types: tuple[str, ...], expected_types: tuple[str, ...]) -> bool:
        """Return whether a predicate with the expected types accepts a term with its actual types."""
        if not expected_types or not actual_types:
            return not expected_types or ROOT_TYPE in expected_types
        matches = [not self._hierarchy.supertypes(type_).isdisjoint(expected_types) for type_ in actual_types]
        # a constant has all its types at once; a variable's object has at least one of its types
        return any(matches) if isinstance(term, Constant) else all(matches)

    def _check_term(self, term: Term, scope: Scope) -> None:
        """Check a term of a comparison, of a numeric effect or of a metric."""
        if isinstance(term, FunctionTerm):
            function = self._functions.get(term.function)
            if function is None and term.function not in ARITHMETIC:
                self._refuse_unsupported(unsupported_formula(term.function), term.position)
                raise self._error(
                    f"Unknown function: {term.function}", term.position, "declare it in (:functions ...)"
                )
            if function is not None:
                parameter_count = sum(len(group.names) for group in function.parameters)
                if parameter_count != len(term.arguments):
                    raise self._error(
                        "Function argument length missmatch,"
                        f" expected {parameter_count} but got {len(term.arguments)}",
                        term.position,
                    )
            for argument in term.arguments:
                self._check_term(argument, scope)
        elif not (isinstance(term, Constant) and number_of(term.name) is not None):
            self._find_types(term, scope)


def _scope_of(variables: TypedList) -> Scope:
    return {name: group.types for group in variables for name in group.names}


def _format_types(types: tuple[str, ...]) -> str:
    if len(types) == 1:
        return types[0]
    return f"(either {' '.join(types)})" if types else ROOT_TYPE


def check_problem(domain: Domain, problem: Problem, warn: Warn | None = None) -> None:
    """Check a problem against its domain.

    :param warn: receives mistakes that do not prevent the use of the problem.
    :raises PddlSemanticError: for the first mistake.
    """
    # the domain gets the problem's objects as constants, and the problem's file for errors
    checker = DomainChecker(
        domain.changed(constants=domain.constants + problem.objects, file=problem.file), warn=warn
    )
    if problem.domain.lower() != domain.name.lower():
        checker.warn(
            f"this problem belongs to the domain {problem.domain}, not to {domain.name}",
            Position(),
            "use the domain that the problem names",
        )
    checker.check_objects(problem.objects)
    for atom in problem.init:
        checker.check_formula(atom)
    for call, _value in problem.numbers:
        # the value of the function is a number already: 0 stands for any number
        checker.check_formula(TermComparison("=", call, Constant("0")))
    checker.check_formula(problem.goal)
    if problem.metric is not None:
        _direction, term = problem.metric
        checker.check_metric(term)
