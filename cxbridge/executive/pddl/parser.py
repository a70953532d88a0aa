"""Parsing and checking of domains, problems and formulas.

The steps: tokens (:mod:`.tokens`), syntax tree (:mod:`.reader`, :mod:`.build`), explanation of a syntax error
(:mod:`.explain`), declared spellings of names (:mod:`.spelling`), checks of names and types
(:mod:`.semantics`). :mod:`.fawkes` has further checks, for texts that Fawkes must accept.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from cxbridge.executive.pddl import fawkes
from cxbridge.executive.pddl.ast import Domain, Formula, Problem
from cxbridge.executive.pddl.brackets import parse_items
from cxbridge.executive.pddl.build import SyntaxBuilder
from cxbridge.executive.pddl.decoding import read_text
from cxbridge.executive.pddl.errors import Warn
from cxbridge.executive.pddl.explain import unexpected_token_error
from cxbridge.executive.pddl.reader import Reader, UnexpectedToken
from cxbridge.executive.pddl.semantics import DomainChecker, check_problem
from cxbridge.executive.pddl.spelling import spell_domain, spell_problem
from cxbridge.executive.pddl.tokens import SourceText


def load_domain(path: str | Path, *, fawkes_compat: bool = False, warn: Warn | None = None) -> Domain:
    """Read a domain from a file, see :func:`parse_domain`.

    :raises PddlError: also if the file cannot be read.
    """
    return parse_domain(read_text(path, "domain"), str(path), fawkes_compat=fawkes_compat, warn=warn)


def load_problem(path: str | Path, domain: Domain, *, warn: Warn | None = None) -> Problem:
    """Read a problem from a file, see :func:`parse_problem`.

    :raises PddlError: also if the file cannot be read.
    """
    return parse_problem(read_text(path, "problem"), domain, str(path), warn=warn)


def parse_domain(
    text: str, file: str | Path = "", *, fawkes_compat: bool = False, warn: Warn | None = None
) -> Domain:
    """Parse and check a domain.

    :param file: the file name for errors.
    :param fawkes_compat: accept and refuse the same texts as Fawkes' parser, see docs/evidence/planning.md.
    :param warn: receives mistakes that do not prevent reading.
    :raises PddlSyntaxError: if the text is not a PDDL domain.
    :raises PddlSemanticError: if a name is undeclared, or a type or number of arguments is wrong.
    """
    source = SourceText(text, str(file))
    if fawkes_compat:
        fawkes.remove_text_after_actions(source)
    domain: Domain = _parse(source, "domain")
    if fawkes_compat:
        fawkes.check_domain(source)
    else:
        domain = spell_domain(domain, source.kinds)
    DomainChecker(domain, fawkes_compat=fawkes_compat, warn=warn).check()
    # Fawkes ignores a part of the text, and a planner must not read more than Fawkes
    return domain if fawkes_compat else replace(domain, text=text)


def parse_problem(text: str, domain: Domain, file: str | Path = "", *, warn: Warn | None = None) -> Problem:
    """Parse a problem and check it against its domain.

    :param file: the file name for errors.
    :param warn: see :func:`parse_domain`.
    :raises PddlSyntaxError: if the text is not a PDDL problem.
    :raises PddlSemanticError: if a name is undeclared, or a type or number of arguments is wrong.
    """
    source = SourceText(text, str(file))
    problem: Problem = _parse(source, "problem")
    problem = spell_problem(problem, domain, source.kinds)
    check_problem(domain, problem, warn)
    return replace(problem, text=text)


def parse_formula(text: str, file: str | Path = "", *, fawkes_compat: bool = False) -> Formula:
    """Parse a condition without checking it against a domain.

    :param file: the file name for errors.
    :param fawkes_compat: refuse also what Fawkes' parser refuses.
    :raises PddlSyntaxError: unless the text is exactly one condition.
    """
    source = SourceText(text, str(file))
    formula: Formula = _parse(source, "condition")
    if fawkes_compat:
        fawkes.check_keyword_case(source)
        fawkes.check_formula(source, parse_items(source)[0])
    return formula


def _parse(source: SourceText, symbol: str) -> Any:
    """Return the syntax tree of a text.

    :param symbol: the start symbol of the grammar.
    """
    try:
        return _load_reader().read(source.tokens, symbol, SyntaxBuilder(source))
    except UnexpectedToken as error:
        raise unexpected_token_error(source, symbol, error) from None


@cache
def _load_reader() -> Reader:
    return Reader(SyntaxBuilder.handler)
