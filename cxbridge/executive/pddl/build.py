"""Construction of syntax trees from the rules of PDDL's grammar."""

from __future__ import annotations

from typing import Any, NamedTuple

from cxbridge.executive.pddl.ast import (
    ActionSchema,
    And,
    Atom,
    Constant,
    Domain,
    Formula,
    Function,
    FunctionTerm,
    Imply,
    Not,
    NumericChange,
    Or,
    Predicate,
    Problem,
    Quantified,
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
from cxbridge.executive.pddl.spelling import TOTAL_TIME
from cxbridge.executive.pddl.tokens import Text, Token
from cxbridge.executive.pddl.unsupported import OBJECT_FLUENTS, TIMED_INITIAL, refusal, unsupported_head

Parts = list[Any]


class Section(NamedTuple):
    """A section of a domain, problem or action.

    :param field: the field of the syntax tree.
    """

    field: str
    keyword: str
    value: Any
    start: int


class _Types(NamedTuple):
    """The types behind a dash; several for ``either``."""

    names: tuple[str, ...]
    start: int


class SyntaxBuilder:
    """Makes syntax trees; each method handles the grammar rule of its name.

    :param text: the tokenised text, for positions and errors.
    """

    def __init__(self, text: Text) -> None:
        self._at = text.position
        self._file = text.file
        self.words_of_numbers: set[str] = set()
        """Words at places of numbers: objects, or functions written without brackets."""

    def _error(self, message: str, start: int, hint: str | None = None) -> PddlSyntaxError:
        return syntax_error(message, self._at(start), self._file, hint)

    def _fields(self, sections: list[Section], owner: str = "") -> dict[str, Any]:
        """Return the sections by field. Each may occur once."""
        fields: dict[str, Any] = {}
        for section in sections:
            if section.field in fields and owner:
                message = f"{owner} has {section.keyword} twice"
                raise self._error(message, section.start, "join them with (and ...)")
            if section.field in fields:
                message = f"there is a second section {section.keyword}"
                raise self._error(message, section.start, "join them")
            fields[section.field] = section.value
        return fields

    def domain(self, parts: Parts, _start: int) -> Domain:
        name, *sections = parts
        actions = tuple(section for section in sections if isinstance(section, ActionSchema))
        fields = self._fields([section for section in sections if isinstance(section, Section)])
        return Domain(name.text, **fields, actions=actions, file=self._file)

    def requirements(self, parts: Parts, start: int) -> Section:
        names = tuple(word.text[1:].lower() for word in parts)
        return Section("requirements", ":requirements", names, start)

    def types(self, parts: Parts, start: int) -> Section:
        return Section("types", ":types", self._typed(parts), start)

    def constants(self, parts: Parts, start: int) -> Section:
        return Section("constants", ":constants", self._typed(parts), start)

    def predicates(self, parts: Parts, start: int) -> Section:
        return Section("predicates", ":predicates", tuple(parts), start)

    def functions(self, parts: Parts, start: int) -> Section:
        """Return the functions of a domain. ``number`` is their only permitted type."""
        functions = []
        for part in parts:
            if isinstance(part, Predicate):
                functions.append(Function(part.name, part.parameters, part.position))
            elif isinstance(part, Token):
                functions.append(Function(part.text, (), self._at(part.start)))
            elif tuple(map(str.lower, part.names)) != ("number",):
                raise self._error(
                    "the value of a function can only be a number: object fluents are not supported",
                    part.start,
                    "write - number",
                )
        return Section("functions", ":functions", tuple(functions), start)

    def declaration(self, parts: Parts, start: int) -> Predicate:
        name, *typed = parts
        return Predicate(name.text, self._typed(typed), self._at(start))

    def _typed(self, parts: Parts) -> TypedList:
        """Return the groups of a typed list, without groups that have no names."""
        groups: list[TypedNames] = []
        names: list[Token] = []
        for each in (*parts, None):
            if isinstance(each, Token):
                names.append(each)
                continue
            if names:
                texts = tuple(name.text.removeprefix("?") for name in names)
                types = each.names if each is not None else ()
                groups.append(TypedNames(texts, types, self._at(names[0].start)))
            names = []
        return tuple(groups)

    def of_type(self, parts: Parts, start: int) -> _Types:
        type_ = parts[1]
        return _Types(
            type_ if isinstance(type_, tuple) and not isinstance(type_, Token) else (type_.text,), start
        )

    def either(self, parts: Parts, _start: int) -> tuple[str, ...]:
        return tuple(word.text for word in parts)

    def problem(self, parts: Parts, start: int) -> Problem:
        name, *sections = parts
        fields = self._fields([section for section in sections if isinstance(section, Section)])
        for needed in ("domain", "goal"):
            if needed not in fields:
                raise self._error(f"there is no (:{needed} ...)", start)
        fields.pop("requirements", None)
        return Problem(name.text, **fields.pop("init", {}), **fields, file=self._file)

    def domain_name(self, parts: Parts, start: int) -> Section:
        return Section("domain", ":domain", parts[0].text, start)

    def objects(self, parts: Parts, start: int) -> Section:
        return Section("objects", ":objects", self._typed(parts), start)

    def init(self, parts: Parts, start: int) -> Section:
        """Return the fields of the initial state."""
        true: dict[Atom, None] = {}
        false: dict[Atom, None] = {}
        numbers: list[tuple[FunctionTerm, float]] = []
        for fact in parts:
            if isinstance(fact, TermComparison):
                numbers.append(self._number(fact))
                continue
            is_true = True
            atom = fact
            while isinstance(atom, Not):
                atom, is_true = atom.part, not is_true
            if not isinstance(atom, Atom):
                raise self._no_fact(fact)
            self._check_objects(atom)
            (true if is_true else false)[atom] = None
        for atom in false:
            if atom in true:
                text = f"({' '.join((atom.predicate, *map(format_term, atom.arguments)))})"
                message = f"{text} is both true and false at the start"
                raise syntax_error(message, atom.position, self._file, "remove one of the two")
        fields = {"init": tuple(true), "init_false": tuple(false), "numbers": tuple(numbers)}
        return Section("init", ":init", fields, start)

    def _no_fact(self, fact: Formula) -> PddlSyntaxError:
        hint = "such as (at r1 home) or (= (distance a b) 3)"
        return syntax_error("a fact is expected", fact.position, self._file, hint)

    def _number(self, fact: TermComparison) -> tuple[FunctionTerm, float]:
        """Return a function with its initial value."""
        call, value = fact.left, fact.right
        if isinstance(call, Constant) and number_of(call.name) is None:
            call = FunctionTerm(call.name, (), call.position)
        if not isinstance(call, FunctionTerm) or not isinstance(value, Constant):
            raise self._no_fact(fact)
        number = number_of(value.name)
        if number is None:
            message = f"'{value.name}' is not a number"
            hint = f"{OBJECT_FLUENTS} are not supported"
            raise syntax_error(message, fact.position, self._file, hint)
        return call, number

    def _check_objects(self, atom: Atom) -> None:
        for index, argument in enumerate(atom.arguments):
            if isinstance(argument, Constant):
                continue
            before = atom.arguments[0]
            is_time = index == 1 and isinstance(before, Constant) and number_of(before.name) is not None
            is_timed = is_time and atom.predicate.lower() == "at"
            name = TIMED_INITIAL if is_timed else unsupported_head(atom.predicate)
            if name:
                message, hint = refusal(name)
                raise syntax_error(message, atom.position, self._file, hint)
            raise syntax_error(f"{format_term(argument)} is not an object", argument.position, self._file)

    def goal(self, parts: Parts, start: int) -> Section:
        return Section("goal", ":goal", parts[0], start)

    def metric(self, parts: Parts, start: int) -> Section:
        direction, term = parts
        self._note_words([term])
        return Section("metric", ":metric", (direction.text.lower(), term), start)

    def length(self, _parts: Parts, _start: int) -> None:
        """Skip the expected length of plans, which no planner here uses."""

    def action(self, parts: Parts, start: int, *, durative: bool = False) -> ActionSchema:
        name, *sections = parts
        fields = self._fields(sections, f"action {name.text}")
        return ActionSchema(name.text, **fields, durative=durative, position=self._at(start))

    def durative_action(self, parts: Parts, start: int) -> ActionSchema:
        return self.action(parts, start, durative=True)

    def parameters(self, parts: Parts, start: int) -> Section:
        return Section("parameters", ":parameters", self._typed(parts), start)

    def precondition(self, parts: Parts, start: int) -> Section:
        return Section("condition", ":precondition", parts[0], start)

    def condition_of_time(self, parts: Parts, start: int) -> Section:
        return Section("condition", ":condition", parts[0], start)

    def duration(self, parts: Parts, start: int) -> Section:
        return Section("duration", ":duration", parts[0], start)

    def effects(self, parts: Parts, start: int) -> Section:
        return Section("effect", ":effect", parts[0], start)

    def conditional_breakup(self, parts: Parts, start: int) -> Section:
        return Section("conditional_breakup", ":conditional-breakup", parts[0], start)

    def temporal_breakup(self, parts: Parts, start: int) -> Section:
        return Section("temporal_breakup", ":temporal-breakup", parts[0], start)

    def atom(self, parts: Parts, start: int) -> Atom:
        return Atom(parts[0].text, tuple(parts[1:]), self._at(start))

    def conjunction(self, parts: Parts, start: int) -> And:
        """Return a conjunction. ``()`` is an empty one."""
        return And(tuple(parts), self._at(start))

    def disjunction(self, parts: Parts, start: int) -> Or:
        return Or(tuple(parts), self._at(start))

    def negation(self, parts: Parts, start: int) -> Not:
        return Not(parts[0], self._at(start))

    def implication(self, parts: Parts, start: int) -> Imply:
        return Imply(parts[0], parts[1], self._at(start))

    def exists(self, parts: Parts, start: int) -> Quantified:
        return self._quantified("exists", parts, start)

    def forall(self, parts: Parts, start: int) -> Quantified:
        return self._quantified("forall", parts, start)

    def _quantified(self, quantifier: str, parts: Parts, start: int) -> Quantified:
        *typed, part = parts
        return Quantified(quantifier, self._typed(typed), part, self._at(start))

    def comparison(self, parts: Parts, start: int) -> TermComparison:
        self._note_words(parts[1:])
        sign, left, right = parts
        return TermComparison(sign.text, left, right, self._at(start))

    def timed(self, parts: Parts, start: int) -> Timed:
        return Timed(" ".join(parts[0].text.lower().split()), parts[1], self._at(start))

    def conditional_effect(self, parts: Parts, start: int) -> When:
        return When(parts[0], parts[1], self._at(start))

    def change(self, parts: Parts, start: int) -> NumericChange:
        self._note_words(parts[1:])
        sign, target, amount = parts
        return NumericChange(sign.text.lower(), target, amount, self._at(start))

    def _note_words(self, terms: Parts) -> None:
        self.words_of_numbers.update(term.name for term in terms if isinstance(term, Constant))

    def variable(self, parts: Parts, start: int) -> Variable:
        name = parts[0].text[1:]
        if not name:
            raise self._error("this variable has no name", start, "write it right after the '?'")
        return Variable(name, self._at(start))

    def constant(self, parts: Parts, start: int) -> Constant:
        return Constant(parts[0].text, self._at(start))

    def function(self, parts: Parts, start: int) -> FunctionTerm:
        self._note_words(parts[1:])
        name = parts[0].text
        if name.lower() == TOTAL_TIME:  # predefined for metrics
            name = TOTAL_TIME
        return FunctionTerm(name, tuple(parts[1:]), self._at(start))
