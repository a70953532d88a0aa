"""Construction of the syntax tree: a method for each rule of PDDL's grammar.

The parser calls a method at the end of its rule, inner rules first. Methods also check two properties that
the grammar cannot express: each section occurs once, and the facts of an initial state have objects as
arguments.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from cxbridge.executive.pddl.ast import (
    ARITHMETIC,
    TOTAL_TIME,
    ActionSchema,
    And,
    Atom,
    Constant,
    Declaration,
    Domain,
    FunctionTerm,
    Imply,
    Not,
    NumericChange,
    Or,
    Problem,
    Quantified,
    Term,
    TermComparison,
    Timed,
    TypedList,
    TypedNames,
    Variable,
    When,
    number_of,
)
from cxbridge.executive.pddl.errors import PddlSyntaxError, syntax_error
from cxbridge.executive.pddl.printer import format_term
from cxbridge.executive.pddl.tokens import SourceText, Token
from cxbridge.executive.pddl.unsupported import (
    OBJECT_FLUENTS,
    TIMED_INITIAL_LITERALS,
    unsupported_formula,
    unsupported_texts,
)

Children = list[Any]
"""The values of a rule's right side: tokens, and the results of the inner rules."""


class Section(NamedTuple):
    """A section of a domain or problem, or a part of an action.

    :param field: the field of the syntax tree that gets the value.
    :param start: the offset of the section in the text.
    """

    field: str
    keyword: str
    value: Any
    start: int


class _TypeNames(NamedTuple):
    """The types after a dash: several for ``either``."""

    names: tuple[str, ...]
    start: int


class SyntaxBuilder:
    """Makes syntax trees; each method handles the grammar rule of its name.

    :param text: the tokenised text, for positions and errors.
    """

    def __init__(self, text: SourceText) -> None:
        self._position = text.position
        self._file = text.file

    def _error(self, message: str, start: int, hint: str | None = None) -> PddlSyntaxError:
        return syntax_error(message, self._position(start), self._file, hint)

    def _section_values(self, children: Children, owner: str) -> dict[str, Any]:
        """Return the values of sections by field, without skipped sections (None) and actions.

        :param owner: the owner of the sections, for errors.
        :raises PddlSyntaxError: if a section occurs twice.
        """
        fields: dict[str, Any] = {}
        for section in (child for child in children if isinstance(child, Section)):
            if section.field in fields:
                message = f"{owner} has {section.keyword} twice"
                raise self._error(message, section.start, "combine the two")
            fields[section.field] = section.value
        return fields

    def domain(self, children: Children, _start: int) -> Domain:
        name, *sections = children
        actions = tuple(section for section in sections if isinstance(section, ActionSchema))
        fields = self._section_values(sections, "the domain")
        return Domain(name.text, **fields, actions=actions, file=self._file)

    def requirements(self, children: Children, start: int) -> Section:
        names = tuple(word.text[1:].lower() for word in children)
        return Section("requirements", ":requirements", names, start)

    def types(self, children: Children, start: int) -> Section:
        return Section("types", ":types", self._typed_list(children), start)

    def constants(self, children: Children, start: int) -> Section:
        return Section("constants", ":constants", self._typed_list(children), start)

    def predicates(self, children: Children, start: int) -> Section:
        return Section("predicates", ":predicates", tuple(children), start)

    def functions(self, children: Children, start: int) -> Section:
        """Return the functions of a domain. ``number`` is their only permitted type."""
        for child in children:
            if isinstance(child, _TypeNames) and tuple(map(str.lower, child.names)) != ("number",):
                raise self._error(
                    "the value of a function can only be a number: object fluents are not supported",
                    child.start,
                    "write - number",
                )
        functions = tuple(
            child
            if isinstance(child, Declaration)
            else Declaration(child.text, (), self._position(child.start))  # a function without brackets
            for child in children
            if not isinstance(child, _TypeNames)
        )
        return Section("functions", ":functions", functions, start)

    def declaration(self, children: Children, start: int) -> Declaration:
        name, *typed = children
        return Declaration(name.text, self._typed_list(typed), self._position(start))

    def _typed_list(self, children: Children) -> TypedList:
        """Return the groups of a typed list, without groups that have no names."""
        groups: list[TypedNames] = []
        names: list[Token] = []
        for child in (*children, None):  # None ends the last group, which may have no type
            if isinstance(child, Token):
                names.append(child)
                continue
            if names:
                texts = tuple(name.text.removeprefix("?") for name in names)
                types = () if child is None else child.names
                groups.append(TypedNames(texts, types, self._position(names[0].start)))
            names = []
        return tuple(groups)

    def of_type(self, children: Children, start: int) -> _TypeNames:
        type_ = children[1]
        # isinstance(type_, tuple) would be true for both: a token is a named tuple
        return _TypeNames((type_.text,) if isinstance(type_, Token) else type_, start)

    def either(self, children: Children, _start: int) -> tuple[str, ...]:
        return tuple(word.text for word in children)

    def problem(self, children: Children, start: int) -> Problem:
        name, *sections = children
        fields = self._section_values(sections, "the problem")
        for field in ("domain", "goal"):
            if field not in fields:
                raise self._error(f"there is no (:{field} ...)", start)
        fields.pop("requirements", None)  # only the requirements of the domain count
        return Problem(name.text, **fields.pop("init", {}), **fields, file=self._file)

    def domain_name(self, children: Children, start: int) -> Section:
        return Section("domain", ":domain", children[0].text, start)

    def objects(self, children: Children, start: int) -> Section:
        return Section("objects", ":objects", self._typed_list(children), start)

    def init(self, children: Children, start: int) -> Section:
        """Return the section of the initial state: facts and numbers."""
        atoms = [fact for fact in children if isinstance(fact, Atom)]
        for atom in atoms:
            self._check_objects(atom)
        numbers = [self._initial_number(fact) for fact in children if isinstance(fact, TermComparison)]
        # a dictionary in place of a set, to keep the order of the text
        fields = {"init": tuple(dict.fromkeys(atoms)), "numbers": tuple(numbers)}
        return Section("init", ":init", fields, start)

    def _initial_number(self, fact: TermComparison) -> tuple[FunctionTerm, float]:
        """Return a function with its initial value."""
        call, value = fact.left, fact.right
        if not isinstance(call, FunctionTerm) or not isinstance(value, Constant):
            hint = "such as (at r1 home) or (= (distance a b) 3)"
            raise syntax_error("a fact is expected", fact.position, self._file, hint)
        number = number_of(value.name)
        if number is None:
            message = f"'{value.name}' is not a number"
            hint = f"{OBJECT_FLUENTS} are not supported"
            raise syntax_error(message, fact.position, self._file, hint)
        return call, number

    def _check_objects(self, atom: Atom) -> None:
        """Refuse terms other than objects in a fact."""
        for index, argument in enumerate(atom.arguments):
            if isinstance(argument, Constant):
                continue
            # (at 5 (open door)) is a timed initial literal, which the grammar reads as an atom
            first = atom.arguments[0]
            has_time = index == 1 and isinstance(first, Constant) and number_of(first.name) is not None
            is_timed = has_time and atom.predicate.lower() == "at"
            name = TIMED_INITIAL_LITERALS if is_timed else unsupported_formula(atom.predicate)
            if name:
                message, hint = unsupported_texts(name)
                raise syntax_error(message, atom.position, self._file, hint)
            raise syntax_error(f"{format_term(argument)} is not an object", argument.position, self._file)

    def goal(self, children: Children, start: int) -> Section:
        return Section("goal", ":goal", children[0], start)

    def metric(self, children: Children, start: int) -> Section:
        direction, term = children
        return Section("metric", ":metric", (direction.text.lower(), self._number(term)), start)

    def skipped(self, _children: Children, _start: int) -> None:
        """Skip the expected length of plans and Fawkes' breakups, which cxbridge's planners do not use."""

    def action(self, children: Children, start: int, *, durative: bool = False) -> ActionSchema:
        name, *sections = children
        fields = self._section_values(sections, f"action {name.text}")
        return ActionSchema(name.text, **fields, durative=durative, position=self._position(start))

    def durative_action(self, children: Children, start: int) -> ActionSchema:
        return self.action(children, start, durative=True)

    def parameters(self, children: Children, start: int) -> Section:
        return Section("parameters", ":parameters", self._typed_list(children), start)

    def precondition(self, children: Children, start: int) -> Section:
        return Section("condition", ":precondition", children[0], start)

    def condition_of_time(self, children: Children, start: int) -> Section:
        return Section("condition", ":condition", children[0], start)

    def duration(self, children: Children, start: int) -> Section:
        return Section("duration", ":duration", children[0], start)

    def effects(self, children: Children, start: int) -> Section:
        return Section("effect", ":effect", children[0], start)

    def atom(self, children: Children, start: int) -> Atom:
        return Atom(children[0].text, tuple(children[1:]), self._position(start))

    def conjunction(self, children: Children, start: int) -> And:
        """Return a conjunction. ``()`` is an empty conjunction."""
        return And(tuple(children), self._position(start))

    def disjunction(self, children: Children, start: int) -> Or:
        return Or(tuple(children), self._position(start))

    def negation(self, children: Children, start: int) -> Not:
        return Not(children[0], self._position(start))

    def implication(self, children: Children, start: int) -> Imply:
        return Imply(children[0], children[1], self._position(start))

    def exists(self, children: Children, start: int) -> Quantified:
        return self._quantified("exists", children, start)

    def forall(self, children: Children, start: int) -> Quantified:
        return self._quantified("forall", children, start)

    def _quantified(self, quantifier: str, children: Children, start: int) -> Quantified:
        *variables, part = children
        return Quantified(quantifier, self._typed_list(variables), part, self._position(start))

    def comparison(self, children: Children, start: int) -> TermComparison:
        sign, left, right = children
        if sign.text != "=":
            left, right = self._number(left), self._number(right)
        elif isinstance(right, FunctionTerm) or (
            isinstance(right, Constant) and number_of(right.name) is not None
        ):
            left = self._number(left)  # two words are objects
        return TermComparison(sign.text, left, right, self._position(start))

    def timed(self, children: Children, start: int) -> Timed:
        time = " ".join(children[0].text.lower().split())  # any white space may be within ``at start``
        return Timed(time, children[1], self._position(start))

    def conditional_effect(self, children: Children, start: int) -> When:
        return When(children[0], children[1], self._position(start))

    def change(self, children: Children, start: int) -> NumericChange:
        sign, target, amount = children
        target, amount = self._number(target), self._number(amount)
        return NumericChange(sign.text.lower(), target, amount, self._position(start))

    def _number(self, term: Term) -> Term:
        """Return a term in place of a number: a word is a function without arguments and brackets."""
        if isinstance(term, Constant) and number_of(term.name) is None:
            return FunctionTerm(_function_name(term.name), (), term.position)
        return term

    def variable(self, children: Children, start: int) -> Variable:
        name = children[0].text[1:]
        if not name:
            raise self._error("this variable has no name", start, "write it right after the '?'")
        return Variable(name, self._position(start))

    def constant(self, children: Children, start: int) -> Constant:
        return Constant(children[0].text, self._position(start))

    def function(self, children: Children, start: int) -> FunctionTerm:
        name, *arguments = children
        if name.text in ARITHMETIC:
            arguments = [self._number(argument) for argument in arguments]
        return FunctionTerm(_function_name(name.text), tuple(arguments), self._position(start))


def _function_name(name: str) -> str:
    """Return the declared form of the function that PDDL predefines for metrics."""
    return TOTAL_TIME if name.lower() == TOTAL_TIME else name
