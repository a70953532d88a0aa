"""PDDL problems: what there is, what holds, what is wanted; from a text, or from facts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

from msgspec import field
from msgspec.structs import replace

from cxbridge.executive.pddl.ast import (
    And,
    Atom,
    Constant,
    Domain,
    Formula,
    FunctionTerm,
    PddlNode,
    Position,
    Term,
    TermComparison,
    TypedList,
    TypedNames,
    names_of,
    number_of,
)
from cxbridge.executive.pddl.brackets import BracketWord, Group, Item, read_items
from cxbridge.executive.pddl.errors import semantic_error
from cxbridge.executive.pddl.formulas import FormulaParser
from cxbridge.executive.pddl.parser import read_text
from cxbridge.executive.pddl.printer import format_formula, format_term, format_typed
from cxbridge.executive.pddl.semantics import DomainChecker

_SECTIONS: Final = (":domain", ":requirements", ":objects", ":init", ":goal", ":metric")


class Problem(PddlNode, frozen=True):
    """A planning problem.

    :param domain: the name of its domain.
    :param objects: the objects beyond the constants of the domain.
    :param init: the atoms that hold at the start; their arguments are constants.
    :param numbers: the values of numeric functions at the start.
    :param goal: what is wanted.
    :param metric: ``minimize`` or ``maximize`` and the term; None when any plan is as good.
    :param file: the file it was read from; empty when none.
    """

    name: str
    domain: str
    objects: TypedList = ()
    init: tuple[Atom, ...] = ()
    numbers: tuple[tuple[FunctionTerm, float], ...] = ()
    goal: Formula = field(default_factory=lambda: And(()))
    metric: tuple[str, Term] | None = None
    file: str = ""


def load_problem(path: str | Path, domain: Domain) -> Problem:
    """Read a problem from a file; see :func:`parse_problem`.

    :raises PddlError: also when the file cannot be read.
    """
    return parse_problem(read_text(path, "problem"), domain, str(path))


def parse_problem(text: str, domain: Domain, file: str | Path = "") -> Problem:
    """Return the problem that a text holds, checked against its domain.

    :param file: what to name in errors.
    :raises PddlSyntaxError: when the text is not a PDDL problem.
    :raises PddlSemanticError: when something in it is undeclared, or of another number or type.
    """
    problem = _ProblemParser(str(file)).problem(read_items(text, str(file)))
    check_problem(domain, problem)
    return problem


def problem_of_facts(
    domain: Domain,
    objects: Iterable[tuple[str, str]],
    facts: Iterable[tuple[str, Sequence[str]]],
    goal: Formula,
    name: str = "problem",
    numbers: Iterable[tuple[tuple[str, Sequence[str]], float]] = (),
) -> Problem:
    """Return the problem that objects, facts and a goal make, checked against the domain.

    With durative actions a plan shall take as little time as possible.

    :param objects: name and type of each; an empty type is ``object``. The domain's constants may be among
        them.
    :param facts: predicate and arguments of each.
    :param numbers: function and arguments, and the value.
    :raises PddlSemanticError: when something is undeclared, or of another number or type.
    """
    constants = set(names_of(domain.constants))
    typed = not {"typing", "adl", "ucpop"}.isdisjoint(domain.requirements)
    groups = tuple(
        TypedNames((each,), (type_,) if type_ and typed else ())
        for each, type_ in dict.fromkeys(objects)
        if each not in constants
    )
    atoms = tuple(
        Atom(predicate, tuple(Constant(argument) for argument in arguments))
        for predicate, arguments in dict.fromkeys((name, tuple(values)) for name, values in facts)
    )
    durative = any(action.durative for action in domain.actions)
    metric = ("minimize", FunctionTerm("total-time", ())) if durative else None
    values = tuple(
        (FunctionTerm(function, tuple(map(Constant, arguments))), value)
        for (function, arguments), value in numbers
    )
    problem = Problem(name, domain.name, groups, atoms, values, goal, metric)
    check_problem(domain, problem)
    return problem


def domain_with_objects(domain: Domain, problem: Problem) -> Domain:
    """Return the domain with the problem's objects among its constants."""
    return replace(domain, constants=domain.constants + problem.objects, file=problem.file)


def check_problem(domain: Domain, problem: Problem) -> None:
    """Check a problem against its domain.

    :raises PddlSemanticError: for the first thing that makes no sense.
    """
    if problem.domain != domain.name:
        raise semantic_error(
            f"this problem is of the domain {problem.domain}, not of {domain.name}",
            Position(),
            problem.file,
            "give the domain that the problem names",
        )
    checker = DomainChecker(domain_with_objects(domain, problem))
    checker.check_objects(problem.objects)
    for atom in problem.init:
        checker.check_formula(atom)
    for call, _value in problem.numbers:
        checker.check_formula(TermComparison("=", call, Constant("0"), call.position))
    checker.check_formula(problem.goal)


def format_problem(problem: Problem) -> str:
    """Return a problem as PDDL, an object group or a fact a line; it parses to the same."""
    lines = [f"(define (problem {problem.name})", f"  (:domain {problem.domain})"]
    lines += ["  (:objects", *(f"    {format_typed((group,))}" for group in problem.objects), "  )"]
    lines += ["  (:init", *(f"    {format_formula(atom)}" for atom in problem.init)]
    lines += [f"    (= {format_term(call)} {format_number(value)})" for call, value in problem.numbers]
    lines += ["  )", f"  (:goal {format_formula(problem.goal)})"]
    if problem.metric is not None:
        lines.append(f"  (:metric {problem.metric[0]} {format_term(problem.metric[1])})")
    return "\n".join([*lines, ")"]) + "\n"


def format_number(value: float) -> str:
    """Return a number as PDDL, which has no exponents."""
    text = f"{value:g}"
    return text if "e" not in text and float(text) == value else f"{value:f}"


class _ProblemParser(FormulaParser):
    """Makes problems of items."""

    def problem(self, items: tuple[Item, ...]) -> Problem:
        if not items:
            raise self.error(
                "there is no problem in this text", Position(), "write (define (problem NAME) ..)"
            )
        define = items[0]
        if not isinstance(define, Group) or define.head != "define":
            raise self.error("a problem must start with (define (problem NAME)", define.position)
        if len(items) > 1:
            raise self.error("there is text after the end of the problem", items[1].position)
        head = define.items[1] if len(define.items) > 1 else define
        name = self._value_of(head, "problem", define.position)
        sections = self._sections(define.items[2:])
        for needed in (":domain", ":goal"):
            if needed not in sections:
                raise self.error(f"there is no ({needed} ...)", define.position)
        init, numbers = self._init(sections.get(":init"))
        objects = sections.get(":objects")
        return Problem(
            name,
            self._value_of(sections[":domain"], ":domain", define.position),
            self.typed_list(objects.items[1:], "an object", variables=False) if objects else (),
            init,
            numbers,
            self.condition(self._only(sections[":goal"])),
            self._metric(sections.get(":metric")),
            self.file,
        )

    def _sections(self, items: tuple[Item, ...]) -> dict[str, Group]:
        sections: dict[str, Group] = {}
        for item in items:
            if not isinstance(item, Group) or item.head not in _SECTIONS:
                what = item.head if isinstance(item, Group) else item.text
                raise self.error(
                    f"unexpected '{what}'", item.position, f"the sections are {', '.join(_SECTIONS)}"
                )
            if item.head in sections:
                raise self.error(f"there is a second section {item.head}", item.position, "join them")
            sections[item.head] = item
        return sections

    def _value_of(self, item: Item, key: str, position: Position) -> str:
        """Return NAME of ``(key NAME)``."""
        if not isinstance(item, Group) or item.head != key or len(item.items) != 2:  # noqa: PLR2004
            raise self.error(f"({key} NAME) is expected", position)
        return self.name(item.items[1], "a name")

    def _only(self, section: Group) -> Item:
        if len(section.items) != 2:  # noqa: PLR2004
            raise self.error(f"({section.head} ...) takes one formula", section.position)
        return section.items[1]

    def _init(self, section: Group | None) -> tuple[tuple[Atom, ...], tuple[tuple[FunctionTerm, float], ...]]:
        atoms: dict[Atom, None] = {}
        numbers: list[tuple[FunctionTerm, float]] = []
        for item in section.items[1:] if section else ():
            formula = self.condition(item)
            match formula:
                case Atom():
                    self._refuse_variables(formula)
                    atoms[formula] = None
                case TermComparison(operator="=", left=FunctionTerm() as call, right=Constant(name=text)):
                    numbers.append((call, self._number(text, item)))
                case _:
                    raise self.error(
                        "a fact is expected", item.position, "such as (at r1 home) or (= (distance a b) 3)"
                    )
        return tuple(atoms), tuple(numbers)

    def _refuse_variables(self, atom: Atom) -> None:
        for argument in atom.arguments:
            if not isinstance(argument, Constant):
                raise self.error(f"{format_term(argument)} is not an object", argument.position)

    def _number(self, text: str, item: Item) -> float:
        number = number_of(text)
        if number is None:
            raise self.error(f"'{text}' is not a number", item.position)
        return number

    def _metric(self, section: Group | None) -> tuple[str, Term] | None:
        if section is None:
            return None
        if len(section.items) == 3 and isinstance(section.items[1], BracketWord):  # noqa: PLR2004
            direction = section.items[1].text
            if direction in ("minimize", "maximize"):
                return direction, self.term(section.items[2])
        raise self.error("(:metric minimize TERM) is expected", section.position)
