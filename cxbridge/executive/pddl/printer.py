"""Domains and formulas as PDDL text that parses to the same tree."""

from __future__ import annotations

from collections.abc import Iterable

from cxbridge.executive.pddl.ast import (
    ActionSchema,
    Declaration,
    Domain,
    Formula,
    FunctionTerm,
    Quantified,
    Term,
    TypedList,
    Variable,
)


def format_formula(formula: Formula) -> str:
    """Return a formula as PDDL in one line."""
    variables = [f"({format_typed(formula.variables, '?')})"] if isinstance(formula, Quantified) else []
    terms = map(format_term, formula.terms)
    return format_list(formula.head, *variables, *terms, *map(format_formula, formula.children))


def format_domain(domain: Domain) -> str:
    """Return a domain as PDDL text."""
    requirements = (f":{name}" for name in domain.requirements)
    sections = [format_list(":requirements", *requirements)]
    if domain.types:
        sections.append(f"(:types {format_typed(domain.types)})")
    if domain.constants:
        sections.append(f"(:constants {format_typed(domain.constants)})")
    # Fawkes' parser requires the sections :requirements and :predicates
    sections.append(_format_declarations(":predicates", domain.predicates))
    if domain.functions:
        sections.append(_format_declarations(":functions", domain.functions))
    sections += map(_format_action, domain.actions)
    return "\n  ".join([f"(define (domain {domain.name})", *sections]) + "\n)\n"


def _format_declarations(section: str, declarations: Iterable[Declaration]) -> str:
    texts = (format_list(declared.name, format_typed(declared.parameters, "?")) for declared in declarations)
    return format_list(section, *texts)


def _format_action(action: ActionSchema) -> str:
    lines = [
        f"(:{'durative-' if action.durative else ''}action {action.name}",
        f"    :parameters ({format_typed(action.parameters, '?')})",
    ]
    sections = {
        ":duration": action.duration,
        ":condition" if action.durative else ":precondition": action.condition,
        ":effect": action.effect,
    }
    lines += [f"    {key} {format_formula(value)}" for key, value in sections.items() if value is not None]
    return "\n".join(lines) + ")"


def format_list(*words: str) -> str:
    """Return words in brackets, without empty words: an action or a fact with its objects, for example."""
    return f"({' '.join(filter(None, words))})"


def format_typed(typed: TypedList, prefix: str = "") -> str:
    """Return a typed list as PDDL; ``prefix`` is ``?`` for variables."""
    texts = []
    for group in typed:
        names = " ".join(prefix + name for name in group.names)
        type_ = group.types[0] if len(group.types) == 1 else f"(either {' '.join(group.types)})"
        texts.append(f"{names} - {type_}" if group.types else names)
    return " ".join(texts)


def format_term(term: Term) -> str:
    """Return a term as PDDL."""
    if isinstance(term, FunctionTerm):
        return format_list(term.function, *map(format_term, term.arguments))
    return f"?{term.name}" if isinstance(term, Variable) else term.name


def format_number(value: float) -> str:
    """Return a number as PDDL, which has no exponents."""
    # :g is shortest, but rounds to six digits
    text = f"{value:g}"
    return text if "e" not in text and float(text) == value else f"{value:f}"
