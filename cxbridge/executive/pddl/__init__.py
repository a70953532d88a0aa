"""PDDL: domains and formulas to a syntax tree, and to the facts of the CLIPS Executive. See docs/pddl.md."""

from __future__ import annotations

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
