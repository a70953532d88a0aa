"""Conversion of formulas and domains to facts, as in Fawkes' feature ``pddl-parser``: same ids, same order.

An id is the concatenation of the parent's id and a counter: the second part of ``pour1`` is ``pour12``. Such
ids may collide (ten parts, operators that end in a digit), but agents match on them.

Facts have predicates of objects only. A comparison of numbers becomes an atom of its variables, and a fact
``domain-comparison`` with its text, which :mod:`cxbridge.executive.problem.numbers` evaluates.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from msgspec import Struct

from cxbridge.clipstext.values import NO_CONSTANT
from cxbridge.errors import PddlError
from cxbridge.executive.pddl.ast import (
    ROOT_TYPE,
    ActionSchema,
    And,
    Atom,
    Declaration,
    Domain,
    Formula,
    FunctionTerm,
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
    names_of,
    pairs_of,
)
from cxbridge.executive.pddl.errors import Warn, semantic_error
from cxbridge.executive.pddl.printer import format_formula, format_list

SlotValue = str | tuple[str, ...]

EQUALITY_PREDICATE = "EQUALITY"
"""The predicate of ``=``."""
CONSTANT_PARAMETER_NAME = "c"
"""The name in ``param-names`` of an argument that is a constant, as in Fawkes."""


class FactToAssert(Struct, frozen=True):
    """A fact to assert.

    :param template: the deftemplate.
    :param slots: a symbol or PDDL text for a slot, a tuple of symbols for a multislot; missing slots get
        their defaults.
    """

    template: str
    slots: dict[str, SlotValue]

    def __str__(self) -> str:
        """Return the fact in CLIPS syntax."""
        slots = (
            format_list(name, value) if isinstance(value, str) else format_list(name, *value)
            for name, value in self.slots.items()
        )
        return format_list(self.template, *slots)


def domain_facts(
    domain: Domain, *, fawkes_compat: bool = False, warn: Warn | None = None
) -> list[FactToAssert]:
    """Return the facts of a domain, in Fawkes' order.

    Constants, functions, durations and requirements have no facts.

    :param fawkes_compat: drop the same parts as Fawkes, see docs/evidence/planning.md.
    :param warn: receives an error about each dropped part.
    :raises PddlError: if facts cannot represent a condition or effect.
    """
    return _FactMaker(domain.file, fawkes_compat=fawkes_compat, warn=warn).domain_facts(domain)


def formula_facts(formula: Formula, parent: str, *, file: str = "") -> list[FactToAssert]:
    """Return the facts of a condition, which are ``part-of`` the parent.

    :raises PddlError: if facts cannot represent the formula, for example a quantifier, or a function as an
        argument of an atom.
    """
    return list(
        _FactMaker(file, fawkes_compat=False, warn=None).condition_facts(formula, parent, 1, is_root=True)
    )


def _find_variables(terms: Iterable[Term]) -> Iterator[Variable]:
    """Yield the variables in terms and their arguments."""
    for term in terms:
        if isinstance(term, Variable):
            yield term
        elif isinstance(term, FunctionTerm):
            yield from _find_variables(term.arguments)


class _FactMaker:
    """Makes the facts of one domain or condition."""

    def __init__(self, file: str, *, fawkes_compat: bool, warn: Warn | None) -> None:
        self._file = file
        self._fawkes_compat = fawkes_compat
        self._warn = warn

    def _error(self, message: str, position: Position, hint: str | None = None) -> PddlError:
        return semantic_error(message, position, self._file, hint)

    def _warn_about_dropped_part(self, message: str, position: Position) -> None:
        if self._warn is not None:
            self._warn(self._error(message, position))

    def domain_facts(self, domain: Domain) -> list[FactToAssert]:
        return [
            *(
                FactToAssert(
                    "domain-object-type",
                    {"name": name, "super-type": super_type} if super_type else {"name": name},
                )
                for name, super_type in pairs_of(domain.types)
            ),
            *map(self._predicate_fact, domain.predicates),
            *(fact for action in domain.actions for fact in self._action_facts(action)),
        ]

    def _predicate_fact(self, predicate: Declaration) -> FactToAssert:
        names, types = self._declared_parameters(predicate.parameters)
        # as in Fawkes, a parameter without type adds nothing to param-types, which is then shorter
        return FactToAssert(
            "domain-predicate",
            {
                "name": predicate.name,
                "param-names": names,
                "param-types": tuple(type_ for type_ in types if type_),
            },
        )

    def _declared_parameters(self, parameters: TypedList) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return names and types of the parameters of a predicate or an action; a missing type is empty."""
        # Fawkes repeats the names for each type of an ``either``, which adds parameters
        if self._fawkes_compat:
            pairs = list(pairs_of(parameters))
            return tuple(name for name, _ in pairs), tuple(type_ for _, type_ in pairs)
        # a fact has one type for each parameter, so an ``either`` becomes the root type
        types = []
        for group in parameters:
            type_ = group.types[0] if len(group.types) == 1 else ROOT_TYPE if group.types else ""
            types += [type_] * len(group.names)
        return names_of(parameters), tuple(types)

    def _action_facts(self, action: ActionSchema) -> Iterator[FactToAssert]:
        for name, type_ in pairs_of(action.parameters):
            if self._fawkes_compat and not type_:
                self._warn_about_dropped_part(
                    f"parameter ?{name} of {action.name} has no type, and gets no fact", action.position
                )
            else:
                type_slot = {"type": type_} if type_ else {}
                yield FactToAssert(
                    "domain-operator-parameter", {"name": name, "operator": action.name, **type_slot}
                )
        names, _types = self._declared_parameters(action.parameters)
        yield FactToAssert("domain-operator", {"name": action.name, "param-names": names})
        if action.condition is not None:
            yield from self.condition_facts(action.condition, action.name, 1, is_root=True)
        if action.effect is not None:
            yield from self._effect_facts(action.effect, action.name, is_positive=True)

    def condition_facts(
        self, formula: Formula, parent: str, counter: int, *, is_root: bool = False
    ) -> Iterator[FactToAssert]:
        """Yield the facts of a formula.

        :param parent: the id of the formula or operator that the formula is part of.
        :param counter: the position of the formula in its parent, from 1.
        :param is_root: whether the formula is the whole condition.
        """
        id_ = f"{parent}{counter}"
        match formula.reduced:
            case Timed(part=part):
                # Fawkes does not wrap a timed atom at the root
                yield from self.condition_facts(part, parent, counter)
            case And(parts=parts):
                yield from self._connective_facts("conjunction", parts, parent, id_)
            case Or(parts=parts):
                yield from self._connective_facts("disjunction", parts, parent, id_)
            case Not(part=part):
                yield from self._connective_facts("negation", (part,), parent, id_)
            case Atom(predicate=predicate, arguments=terms):
                yield from self._atom_facts(predicate, terms, parent, id_, formula.position, is_root=is_root)
            case TermComparison() as comparison:
                yield from self._comparison_facts(comparison, parent, id_, is_root=is_root)
            case When() | NumericChange():
                raise self._error("an effect cannot be a condition", formula.position)
            case _:
                raise self._error(
                    f"'{formula.head}' in a condition cannot be expressed as facts",
                    formula.position,
                    f"the CLIPS Executive has no {formula.KIND.feature}: write the condition out",
                )

    def _comparison_facts(
        self, formula: TermComparison, parent: str, id_: str, *, is_root: bool
    ) -> Iterator[FactToAssert]:
        """Yield the facts of a comparison, which becomes an atom.

        If the comparison has functions, the atom's arguments are its variables, and a further fact has its
        text.
        """
        terms, position = formula.terms, formula.position
        if self._fawkes_compat or not any(isinstance(term, FunctionTerm) for term in terms):
            predicate = EQUALITY_PREDICATE if formula.operator == "=" else formula.operator
            yield from self._atom_facts(predicate, terms, parent, id_, position, is_root=is_root)
            return
        variables = tuple({term.name: term for term in _find_variables(terms)}.values())  # each variable once
        atom_facts = [*self._atom_facts(formula.operator, variables, parent, id_, position, is_root=is_root)]
        yield from atom_facts
        predicate_fact = atom_facts[-1]  # pddl-predicate comes last
        slots = {"predicate-id": predicate_fact.slots["id"], "text": format_formula(formula)}
        yield FactToAssert("domain-comparison", slots)

    def _connective_facts(
        self, kind: str, parts: tuple[Formula, ...], parent: str, id_: str
    ) -> Iterator[FactToAssert]:
        yield FactToAssert("pddl-formula", {"id": id_, "part-of": parent, "type": kind})
        for index, part in enumerate(parts, start=1):
            yield from self.condition_facts(part, id_, index)

    def _atom_facts(
        self,
        predicate: str,
        terms: tuple[Term, ...],
        parent: str,
        id_: str,
        position: Position,
        *,
        is_root: bool,
    ) -> Iterator[FactToAssert]:
        if is_root:  # as in Fawkes, a condition that is a single atom becomes a conjunction
            yield FactToAssert("pddl-formula", {"id": id_, "part-of": parent, "type": "conjunction"})
            parent, id_ = id_, f"{id_}1"
        parameters = self._parameter_slots(terms, position)
        yield FactToAssert("pddl-formula", {"id": id_, "part-of": parent, "type": "atom"})
        yield FactToAssert(
            "pddl-predicate",
            {"id": f"{id_}-atom", "part-of": id_, "predicate": predicate, **parameters},
        )

    def _parameter_slots(self, terms: tuple[Term, ...], position: Position) -> dict[str, SlotValue]:
        """Return the slots ``param-names`` and ``param-constants`` of an atom's fact."""
        names, constants = [], []
        for term in terms:
            if isinstance(term, Variable):
                names.append(term.name)
                constants.append(NO_CONSTANT)
            elif isinstance(term, FunctionTerm):
                raise self._error(
                    "a number or nested predicate cannot be expressed as facts",
                    position,
                    "Fawkes only supports predicates of objects: leave numbers to the planner",
                )
            else:
                names.append(CONSTANT_PARAMETER_NAME)
                constants.append(term.name)
        return {"param-names": tuple(names), "param-constants": tuple(constants)}

    def _effect_facts(self, formula: Formula, action: str, *, is_positive: bool) -> Iterator[FactToAssert]:
        match formula:
            case And() | Timed():
                for part in formula.children:
                    yield from self._effect_facts(part, action, is_positive=is_positive)
            case Not(part=part):
                yield from self._effect_facts(part, action, is_positive=not is_positive)
            case Atom(predicate=predicate, arguments=terms):
                slots = {"part-of": action, "predicate": predicate}
                parameters = self._parameter_slots(terms, formula.position)
                sign = "POSITIVE" if is_positive else "NEGATIVE"
                yield FactToAssert("domain-effect", {**slots, **parameters, "type": sign})
            case NumericChange(operator=operator):
                # PddlNumbers computes numeric effects from the domain
                if self._fawkes_compat:
                    self._warn_about_dropped_part(f"Fawkes has no fact for '{operator}'", formula.position)
            case Quantified(quantifier=quantifier):
                raise self._error(
                    f"'{quantifier}' in an effect cannot be expressed as facts",
                    formula.position,
                    "the CLIPS Executive has no quantifiers: write the effects out",
                )
            case _:
                self._refuse_effect(formula)

    def _refuse_effect(self, formula: Formula) -> None:
        """Refuse an effect that facts cannot express; with ``fawkes_compat``, drop it with a warning."""
        nouns: dict[type, str] = {When: "a conditional effect (when)", TermComparison: "a comparison"}
        noun = nouns.get(type(formula), f"'{formula.head}'")
        message = f"{noun} in an effect cannot be expressed as facts"
        if not self._fawkes_compat:
            hint = "split the action into two" if isinstance(formula, When) else None
            raise self._error(message, formula.position, hint)
        self._warn_about_dropped_part(message, formula.position)
