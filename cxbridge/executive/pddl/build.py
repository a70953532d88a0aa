"""Construction of the syntax tree: a method or a row of a table for each rule of PDDL's grammar.

The parser calls a method at the end of its rule, inner rules first. Some methods also check rules that the
grammar cannot express, for example that each section occurs once, and that the facts of an initial state have
objects as arguments.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple

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
    PddlNode,
    Position,
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
from cxbridge.executive.pddl.reader import Build
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


MakeValue = Callable[["SyntaxBuilder", Children], Any]
"""Makes the value of a section from the children of its rule."""

MakeNode = Callable[[Children, Position], PddlNode]
"""Makes a node of the syntax tree from the children of its rule and the position of the node."""


class SyntaxBuilder:
    """Makes syntax trees; a method or a row of a table handles the grammar rule of its name.

    Methods raise a PddlSyntaxError if the text breaks a rule that the grammar cannot express.

    :param text: the tokenised text, for positions and errors.
    """

    def __init__(self, text: SourceText) -> None:
        self.position = text.position
        self._file = text.file

    @classmethod
    def handler(cls, rule: str) -> Build:
        """Return the function that makes the value of a rule."""
        if rule in _SECTIONS:
            field, keyword, make_value = _SECTIONS[rule]
            return lambda builder, children, start: Section(
                field, keyword, make_value(builder, children), start
            )
        if rule in _NODES:
            make_node = _NODES[rule]
            return lambda builder, children, start: make_node(children, builder.position(start))
        method: Build = getattr(cls, rule)
        return method

    def _error(self, message: str, start: int, hint: str | None = None) -> PddlSyntaxError:
        return syntax_error(message, self.position(start), self._file, hint)

    def _section_values(self, children: Children, owner: str) -> dict[str, Any]:
        """Return the values of sections by field; children that are no sections are ignored.

        :param owner: the owner of the sections, for errors.
        :raises PddlSyntaxError: if a section occurs twice.
        """
        fields: dict[str, Any] = {}
        for section in (child for child in children if isinstance(child, Section)):
            if section.field in fields:
                raise self._error(
                    f"{owner} has {section.keyword} twice", section.start, "combine the two sections"
                )
            fields[section.field] = section.value
        return fields

    def domain(self, children: Children, _start: int) -> Domain:
        name, *sections = children
        actions = tuple(section for section in sections if isinstance(section, ActionSchema))
        fields = self._section_values(sections, "the domain")
        return Domain(name.text, **fields, actions=actions, file=self._file)

    def function_declarations(self, children: Children) -> tuple[Declaration, ...]:
        """Return the functions of a domain. ``number`` is their only permitted type."""
        for child in children:
            if isinstance(child, _TypeNames) and tuple(map(str.lower, child.names)) != ("number",):
                raise self._error(
                    "the value of a function can only be a number: object fluents are not supported",
                    child.start,
                    "write - number",
                )
        # a bare name is a function without brackets
        return tuple(
            child
            if isinstance(child, Declaration)
            else Declaration(child.text, (), position=self.position(child.start))
            for child in children
            if not isinstance(child, _TypeNames)
        )

    def declaration(self, children: Children, start: int) -> Declaration:
        name, *typed = children
        return Declaration(name.text, self.typed_list(typed), position=self.position(start))

    def typed_list(self, children: Children) -> TypedList:
        """Return the groups of a typed list, without groups that have no names."""
        groups: list[TypedNames] = []
        name_tokens: list[Token] = []
        for child in (*children, None):  # None ends the last group, which may have no type
            if isinstance(child, Token):
                name_tokens.append(child)
                continue
            if name_tokens:
                groups.append(
                    TypedNames(
                        tuple(name.text.removeprefix("?") for name in name_tokens),
                        () if child is None else child.names,
                        position=self.position(name_tokens[0].start),
                    )
                )
            name_tokens = []
        return tuple(groups)

    def of_type(self, children: Children, start: int) -> _TypeNames:
        _dash, type_ = children
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

    def initial_state(self, children: Children) -> dict[str, Any]:
        """Return the fields of a problem for its initial state: facts and numbers."""
        atoms = [fact for fact in children if isinstance(fact, Atom)]
        for atom in atoms:
            self._check_objects(atom)
        numbers = (self._initial_number(fact) for fact in children if isinstance(fact, TermComparison))
        # a dictionary in place of a set, to keep the order of the text
        return {"init": tuple(dict.fromkeys(atoms)), "numbers": tuple(numbers)}

    def _initial_number(self, fact: TermComparison) -> tuple[FunctionTerm, float]:
        """Return a function with its initial value."""
        call, value = fact.left, fact.right
        if not isinstance(call, FunctionTerm) or not isinstance(value, Constant):
            hint = "such as (at r1 home) or (= (distance a b) 3)"
            raise syntax_error("a fact is expected", fact.position, self._file, hint)
        number = number_of(value.name)
        if number is None:
            hint = f"{OBJECT_FLUENTS} are not supported"
            raise syntax_error(f"'{value.name}' is not a number", fact.position, self._file, hint)
        return call, number

    def _check_objects(self, atom: Atom) -> None:
        """Refuse terms other than objects in a fact."""
        for index, argument in enumerate(atom.arguments):
            if isinstance(argument, Constant):
                continue
            # (at 5 (open door)) is a timed initial literal, which the grammar reads as an atom
            first_argument = atom.arguments[0]
            has_time = (
                index == 1
                and isinstance(first_argument, Constant)
                and number_of(first_argument.name) is not None
            )
            part_name = (
                TIMED_INITIAL_LITERALS
                if has_time and atom.predicate.lower() == "at"
                else unsupported_formula(atom.predicate)
            )
            if part_name:
                message, hint = unsupported_texts(part_name)
                raise syntax_error(message, atom.position, self._file, hint)
            raise syntax_error(f"{format_term(argument)} is not an object", argument.position, self._file)

    def metric_term(self, children: Children) -> tuple[str, Term]:
        direction, term = children
        return direction.text.lower(), self._number(term)

    def skipped(self, _children: Children, _start: int) -> None:
        """Skip the expected length of plans, Fawkes' breakups, and negated facts in an initial state.

        No planner of cxbridge uses the first two, and a fact is false without its negation, too.
        """

    def action(self, children: Children, start: int, *, is_durative: bool = False) -> ActionSchema:
        name, *sections = children
        fields = self._section_values(sections, f"action {name.text}")
        return ActionSchema(name.text, **fields, is_durative=is_durative, position=self.position(start))

    def durative_action(self, children: Children, start: int) -> ActionSchema:
        return self.action(children, start, is_durative=True)

    def exists(self, children: Children, start: int) -> Quantified:
        return self._quantified("exists", children, start)

    def forall(self, children: Children, start: int) -> Quantified:
        return self._quantified("forall", children, start)

    def _quantified(self, quantifier: str, children: Children, start: int) -> Quantified:
        *variables, part = children
        return Quantified(quantifier, self.typed_list(variables), part, position=self.position(start))

    def comparison(self, children: Children, start: int) -> TermComparison:
        operator, left, right = children
        if operator.text != "=":
            left, right = self._number(left), self._number(right)
        elif isinstance(right, FunctionTerm) or (
            isinstance(right, Constant) and number_of(right.name) is not None
        ):
            left = self._number(left)  # before a number, a word is a function; two words are objects
        return TermComparison(operator.text, left, right, position=self.position(start))

    def timed(self, children: Children, start: int) -> Timed:
        time = " ".join(children[0].text.lower().split())  # any white space may be within ``at start``
        return Timed(time, children[1], position=self.position(start))

    def change(self, children: Children, start: int) -> NumericChange:
        operator, target, amount = children
        target, amount = self._number(target), self._number(amount)
        return NumericChange(operator.text.lower(), target, amount, position=self.position(start))

    def _number(self, term: Term) -> Term:
        """Return a term in place of a number: a word is a function without arguments and brackets."""
        if isinstance(term, Constant) and number_of(term.name) is None:
            return FunctionTerm(_function_name(term.name), (), position=term.position)
        return term

    def variable(self, children: Children, start: int) -> Variable:
        name = children[0].text[1:]
        if not name:
            raise self._error("this variable has no name", start, "write the name right after the '?'")
        return Variable(name, position=self.position(start))

    def function(self, children: Children, start: int) -> FunctionTerm:
        name, *arguments = children
        if name.text in ARITHMETIC:
            arguments = [self._number(argument) for argument in arguments]
        return FunctionTerm(_function_name(name.text), tuple(arguments), position=self.position(start))


def _function_name(name: str) -> str:
    """Return the name of a function; ``total-time``, which no domain declares, is always in lower case."""
    return TOTAL_TIME if name.lower() == TOTAL_TIME else name


def _only_child(_builder: SyntaxBuilder, children: Children) -> Any:
    (child,) = children
    return child


# the sections by grammar rule: field of the syntax tree, keyword, and the function that makes the value
_SECTIONS: Final[dict[str, tuple[str, str, MakeValue]]] = {
    "requirements": (
        "requirements",
        ":requirements",
        lambda _builder, words: tuple(word.text[1:].lower() for word in words),
    ),
    "types": ("types", ":types", SyntaxBuilder.typed_list),
    "constants": ("constants", ":constants", SyntaxBuilder.typed_list),
    "predicates": ("predicates", ":predicates", lambda _builder, declarations: tuple(declarations)),
    "functions": ("functions", ":functions", SyntaxBuilder.function_declarations),
    "domain_name": ("domain", ":domain", lambda _builder, names: names[0].text),
    "objects": ("objects", ":objects", SyntaxBuilder.typed_list),
    "init": ("init", ":init", SyntaxBuilder.initial_state),
    "goal": ("goal", ":goal", _only_child),
    "metric": ("metric", ":metric", SyntaxBuilder.metric_term),
    "parameters": ("parameters", ":parameters", SyntaxBuilder.typed_list),
    "precondition": ("condition", ":precondition", _only_child),
    "condition_of_time": ("condition", ":condition", _only_child),
    "duration": ("duration", ":duration", _only_child),
    "effects": ("effect", ":effect", _only_child),
}
# the nodes by grammar rule; ``()`` is an empty conjunction
_NODES: Final[dict[str, MakeNode]] = {
    "atom": lambda children, position: Atom(children[0].text, tuple(children[1:]), position=position),
    "conjunction": lambda children, position: And(tuple(children), position=position),
    "disjunction": lambda children, position: Or(tuple(children), position=position),
    "negation": lambda children, position: Not(*children, position=position),
    "implication": lambda children, position: Imply(*children, position=position),
    "conditional_effect": lambda children, position: When(*children, position=position),
    "constant": lambda children, position: Constant(children[0].text, position=position),
}
