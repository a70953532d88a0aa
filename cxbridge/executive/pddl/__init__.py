"""PDDL: parsing of domains, problems and formulas, and conversions from and to facts.

See docs/planning.md#pddl.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cxbridge.executive.pddl.ast import Domain, Formula, Problem, names_of, pairs_of
    from cxbridge.executive.pddl.errors import PddlSemanticError, PddlSyntaxError
    from cxbridge.executive.pddl.facts import FactToAssert, domain_facts, formula_facts
    from cxbridge.executive.pddl.parser import (
        load_domain,
        load_problem,
        parse_domain,
        parse_formula,
        parse_problem,
    )
    from cxbridge.executive.pddl.printer import format_domain, format_formula
    from cxbridge.executive.pddl.problems import format_problem, problem_of_facts

_NAMES_BY_MODULE = {
    "ast": ("Domain", "Formula", "Problem", "names_of", "pairs_of"),
    "errors": ("PddlSemanticError", "PddlSyntaxError"),
    "facts": ("FactToAssert", "domain_facts", "formula_facts"),
    "parser": ("load_domain", "load_problem", "parse_domain", "parse_formula", "parse_problem"),
    "printer": ("format_domain", "format_formula"),
    "problems": ("format_problem", "problem_of_facts"),
}

__all__ = [
    "Domain",
    "FactToAssert",
    "Formula",
    "PddlSemanticError",
    "PddlSyntaxError",
    "Problem",
    "domain_facts",
    "format_domain",
    "format_formula",
    "format_problem",
    "formula_facts",
    "load_domain",
    "load_problem",
    "names_of",
    "pairs_of",
    "parse_domain",
    "parse_formula",
    "parse_problem",
    "problem_of_facts",
]


def __getattr__(name: str) -> Any:
    """Import a name on first use: a planner process needs the syntax tree without the parser."""
    for module, names in _NAMES_BY_MODULE.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
