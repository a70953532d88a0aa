"""Checks a PDDL file without an agent: a domain, or a problem whose domain is in the same folder."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from cxbridge.errors import PddlError
from cxbridge.executive.pddl import Domain, Problem, load_domain, parse_domain, parse_problem
from cxbridge.executive.pddl.decoding import read_text
from cxbridge_studio.check import doubts
from cxbridge_studio.check.checks.domain import DOMAIN, DUBIOUS, NO_DOMAIN
from cxbridge_studio.check.findings import Finding, SourcePlace, of_error

SUFFIX: Final = ".pddl"
# (:domain NAME) in a problem
_DOMAIN_OF_PROBLEM: Final = re.compile(r"\(\s*:domain\s+([^\s()]+)\s*\)", re.IGNORECASE)
# (domain NAME) in a domain
_NAME_OF_DOMAIN: Final = re.compile(r"\(\s*domain\s+([^\s()]+)\s*\)", re.IGNORECASE)
_COMMENT: Final = re.compile(r";[^\n]*")


def findings_of(file: Path, text: str | None = None, *, fawkes_compat: bool = False) -> list[Finding]:
    """Return the findings for a PDDL file; those for a problem include findings for its domain.

    :param text: the text to check instead of the file's content.
    :param fawkes_compat: see :func:`~cxbridge.executive.pddl.parse_domain`.
    """
    findings: list[Finding] = []

    def warn(mistake: PddlError) -> None:
        findings.append(of_error(mistake, DUBIOUS))

    try:
        text = read_text(file, "PDDL file") if text is None else text
        domain_name = _DOMAIN_OF_PROBLEM.search(_COMMENT.sub("", text))
        if domain_name is None:  # only problems refer to a domain, so the file is a domain
            domain = parse_domain(text, file, fawkes_compat=fawkes_compat, warn=warn)
            # Without a problem, any predicate may be true at the start.
            return [*findings, *_findings(file, doubts.of_domain(domain))]
        path = _find_domain(file, domain_name[1])
        if path is None:
            message = f"there is no domain {domain_name[1]} beside the problem"
            return [Finding(NO_DOMAIN, SourcePlace(str(file)), message)]
        domain = load_domain(path, fawkes_compat=fawkes_compat)
        findings += _of_problem(file, parse_problem(text, domain, file, warn=warn), domain)
    except PddlError as error:
        findings.append(of_error(error, DOMAIN))
    return findings


def _of_problem(file: Path, problem: Problem, domain: Domain) -> Iterator[Finding]:
    initial_predicates = {atom.predicate for atom in problem.init}
    yield from _findings(file, doubts.of_objects(domain, problem.objects))
    yield from _findings(Path(domain.file), doubts.of_domain(domain, initial_predicates))
    yield from _findings(file, doubts.of_goal(domain, problem.goal, initial_predicates))


def _findings(file: Path, doubts_of_file: Iterator[doubts.Doubt]) -> Iterator[Finding]:
    for doubt in doubts_of_file:
        place = SourcePlace(str(file), doubt.position.line, doubt.position.column)
        yield Finding(doubt.code, place, doubt.message)


def _find_domain(problem: Path, name: str) -> Path | None:
    """Return the file in the folder of a problem that defines the domain; None if there is none."""
    for path in sorted(problem.parent.glob(f"*{SUFFIX}")):
        try:
            match = _NAME_OF_DOMAIN.search(_COMMENT.sub("", read_text(path, "PDDL file")))
        except PddlError:  # the folder may contain files that are not texts
            continue
        if path != problem and match is not None and match[1].lower() == name.lower():
            return path
    return None
