"""PDDL problems made from facts, and problems as text."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from cxbridge.executive.pddl.ast import (
    TOTAL_TIME,
    Atom,
    Constant,
    Domain,
    Formula,
    FunctionTerm,
    Problem,
    TypedNames,
    names_of,
)
from cxbridge.executive.pddl.printer import format_formula, format_number, format_term, format_typed
from cxbridge.executive.pddl.semantics import check_problem


def problem_of_facts(
    domain: Domain,
    objects: Iterable[tuple[str, str]],
    facts: Iterable[tuple[str, Sequence[str]]],
    goal: Formula,
    name: str = "problem",
    numbers: Iterable[tuple[tuple[str, Sequence[str]], float]] = (),
) -> Problem:
    """Make a problem from objects, facts and a goal, and check it against the domain.

    Repeated objects and facts count once. If the domain has durative actions, the metric minimises
    ``total-time``.

    :param objects: names and types, possibly including constants of the domain; an empty type is ``object``.
    :param facts: predicates and arguments.
    :param numbers: functions with arguments, and values.
    :raises PddlSemanticError: if a name is undeclared, or a type or number of arguments is wrong.
    """
    constants = set(names_of(domain.constants))
    is_typed = domain.is_typed
    typed_objects = tuple(
        TypedNames((object_name,), (type_,) if type_ and is_typed else ())
        for object_name, type_ in dict.fromkeys(objects)
        if object_name not in constants
    )
    atoms = tuple(
        Atom(predicate, tuple(Constant(argument) for argument in arguments))
        for predicate, arguments in dict.fromkeys(
            (predicate, tuple(arguments)) for predicate, arguments in facts
        )
    )
    is_temporal = any(action.is_durative for action in domain.actions)
    problem = Problem(
        name,
        domain.name,
        typed_objects,
        atoms,
        numbers=tuple(
            (FunctionTerm(function, tuple(map(Constant, arguments))), value)
            for (function, arguments), value in numbers
        ),
        goal=goal,
        metric=("minimize", FunctionTerm(TOTAL_TIME, ())) if is_temporal else None,
    )
    check_problem(domain, problem)
    return problem


def format_problem(problem: Problem) -> str:
    """Return a problem as PDDL text, which parses to the same problem except that numbers may be rounded."""
    lines = [f"(define (problem {problem.name})", f"  (:domain {problem.domain})"]
    lines += ["  (:objects", *(f"    {format_typed((group,))}" for group in problem.objects), "  )"]
    lines += ["  (:init", *(f"    {format_formula(atom)}" for atom in problem.init)]
    lines += [f"    (= {format_term(call)} {format_number(value)})" for call, value in problem.numbers]
    lines += ["  )", f"  (:goal {format_formula(problem.goal)})"]
    if problem.metric is not None:
        direction, term = problem.metric
        lines.append(f"  (:metric {direction} {format_term(term)})")
    return "\n".join([*lines, ")"]) + "\n"
