"""Domains and formulas as PDDL text that parses to the same tree."""

from __future__ import annotations

from collections.abc import Iterable

from cxbridge.executive.pddl.ast import (
    QUANTIFIER_WORDS,
    ActionSchema,
    Declaration,
    Domain,
    Formula,
    FunctionTerm,
    Term,
    TypedList,
    Variable,
)


def format_formula(formula: Formula) -> str:
    """Return a formula as PDDL in one line."""
    is_quantified = formula.head in QUANTIFIER_WORDS
    variables = [f"({format_typed(formula.variables, '?')})"] if is_quantified else []
    terms = map(format_term, formula.terms)
    return format_list(formula.head, *variables, *terms, *map(format_formula, formula.children))


def format_domain(domain: Domain) -> str:
    """Return a domain as PDDL text."""
    sections = [
        f"(define (domain {domain.name})",
        # Fawkes' parser requires the sections :requirements and :predicates
        format_list(":requirements", *(f":{name}" for name in domain.requirements)),
        f"(:types {format_typed(domain.types)})" if domain.types else "",
        f"(:constants {format_typed(domain.constants)})" if domain.constants else "",
        _format_declarations(":predicates", domain.predicates),
        _format_declarations(":functions", domain.functions) if domain.functions else "",
        *map(_format_action, domain.actions),
    ]
    return "\n  ".join(filter(None, sections)) + "\n)\n"


def _format_declarations(section: str, declarations: Iterable[Declaration]) -> str:
    return format_list(
        section,
        *(format_list(declared.name, format_typed(declared.parameters, "?")) for declared in declarations),
    )


def _format_action(action: ActionSchema) -> str:
    lines = [
        f"(:{'durative-' if action.is_durative else ''}action {action.name}",
        f"    :parameters ({format_typed(action.parameters, '?')})",
    ]
    sections = {
        ":duration": action.duration,
        ":condition" if action.is_durative else ":precondition": action.condition,
        ":effect": action.effect,
    }
    lines += [f"    {key} {format_formula(value)}" for key, value in sections.items() if value is not None]
    return "\n".join(lines) + ")"


def format_list(*words: str) -> str:
    """Return words in brackets, without empty words: an action or a fact with its objects, for example."""
    return f"({' '.join(filter(None, words))})"


def format_typed(typed_list: TypedList, prefix: str = "") -> str:
    """Return a typed list as PDDL; ``prefix`` is ``?`` for variables."""
    words: list[str] = []
    for group in typed_list:
        words += (f"{prefix}{name}" for name in group.names)
        if group.types:
            words += (
                ("-", *group.types) if len(group.types) == 1 else ("-", format_list("either", *group.types))
            )
    return " ".join(words)


def format_term(term: Term) -> str:
    """Return a term as PDDL."""
    if isinstance(term, FunctionTerm):
        return format_list(term.function, *map(format_term, term.arguments))
    return f"?{term.name}" if isinstance(term, Variable) else term.name


def format_number(value: float) -> str:
    """Return a number without an exponent, which standard PDDL lacks.

    A number with more than six digits is rounded to six decimals.
    """
    # :g is shortest, but rounds to six digits and may write an exponent
    text = f"{value:g}"
    return text if "e" not in text and float(text) == value else f"{value:f}"
