"""Domains and formulas as PDDL text that parses to the same tree."""

from __future__ import annotations

from collections.abc import Iterator

from cxbridge.executive.pddl.ast import (
    ActionSchema,
    And,
    Atom,
    Domain,
    Formula,
    FunctionTerm,
    Imply,
    Not,
    NumericChange,
    Or,
    Quantified,
    Term,
    TermComparison,
    Timed,
    TypedList,
    Variable,
    When,
)


def format_formula(formula: Formula) -> str:
    """Return a formula as PDDL in one line."""
    head, *parts = _parts(formula)
    return _list(head, *parts)


def _parts(formula: Formula) -> Iterator[str]:
    """Yield the first word of a formula, and the texts of its parts."""
    match formula:
        case Atom(predicate=head, arguments=terms):
            yield from (head, *map(format_term, terms))
        case And(parts=parts) | Or(parts=parts):
            yield from ("and" if isinstance(formula, And) else "or", *map(format_formula, parts))
        case Not(part=part):
            yield from ("not", format_formula(part))
        case Imply(condition=first, consequence=second) | When(condition=first, effect=second):
            head = "imply" if isinstance(formula, Imply) else "when"
            yield from (head, format_formula(first), format_formula(second))
        case Timed(when=head, part=part):
            yield from (head, format_formula(part))
        case Quantified(quantifier=head, variables=variables, part=part):
            yield from (head, f"({format_typed(variables, '?')})", format_formula(part))
        case TermComparison(operator=head, left=left, right=right):
            yield from (head, format_term(left), format_term(right))
        case NumericChange(operator=head, target=left, amount=right):
            yield from (head, format_term(left), format_term(right))


def format_domain(domain: Domain) -> str:
    """Return a domain as PDDL text."""
    lines = [f"(define (domain {domain.name})"]
    lines.append(f"  {_list(':requirements', *(f':{name}' for name in domain.requirements))}")
    if domain.types:
        lines.append(f"  (:types {format_typed(domain.types)})")
    if domain.constants:
        lines.append(f"  (:constants {format_typed(domain.constants)})")
    for section, declarations in ((":predicates", domain.predicates), (":functions", domain.functions)):
        if declarations or section == ":predicates":
            texts = (
                _list(declaration.name, format_typed(declaration.parameters, "?"))
                for declaration in declarations
            )
            lines.append(f"  {_list(section, *texts)}")
    lines += [_action(action) for action in domain.actions]
    return "\n".join([*lines, ")"]) + "\n"


def _action(action: ActionSchema) -> str:
    lines = [
        f"  (:{'durative-' if action.durative else ''}action {action.name}",
        f"    :parameters ({format_typed(action.parameters, '?')})",
    ]
    sections = {
        ":duration": action.duration,
        ":condition" if action.durative else ":precondition": action.condition,
        ":effect": action.effect,
        ":conditional-breakup": action.conditional_breakup,
        ":temporal-breakup": action.temporal_breakup,
    }
    lines += [f"    {key} {format_formula(part)}" for key, part in sections.items() if part is not None]
    return "\n".join(lines) + ")"


def _list(head: str, *parts: str) -> str:
    return f"({' '.join(part for part in (head, *parts) if part)})"


def format_typed(typed: TypedList, prefix: str = "") -> str:
    """Return a typed list as PDDL; ``prefix`` is ``?`` for variables."""
    texts = []
    for group in typed:
        names = " ".join(prefix + name for name in group.names)
        type_ = group.types[0] if len(group.types) == 1 else f"(either {' '.join(group.types)})"
        texts.append(f"{names} - {type_}" if group.types else names)
    return " ".join(texts)


def format_term(term: Term) -> str:
    if isinstance(term, FunctionTerm):
        return _list(term.function, *map(format_term, term.arguments))
    return f"?{term.name}" if isinstance(term, Variable) else term.name


def format_number(value: float) -> str:
    """Return a number as PDDL, which has no exponents."""
    text = f"{value:g}"
    return text if "e" not in text and float(text) == value else f"{value:f}"
