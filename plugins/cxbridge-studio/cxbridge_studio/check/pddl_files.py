"""Checks a PDDL file without an agent: a domain, or a problem whose domain is in the same folder."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

from cxbridge.errors import PddlError
from cxbridge.executive.pddl import Domain, Problem, load_domain, parse_domain, parse_problem
from cxbridge.executive.pddl.decoding import read_text
from cxbridge_studio.agent.names import NameKind, Use
from cxbridge_studio.agent.pddl import read_pddl
from cxbridge_studio.check import doubts
from cxbridge_studio.check.checks.domain import DUBIOUS_DOMAIN, MISSING_DOMAIN, WRONG_DOMAIN
from cxbridge_studio.check.findings import Finding, SourcePlace, make_error_finding

PDDL_SUFFIX: Final = ".pddl"


def check_pddl_file(file: Path, text: str | None = None, *, fawkes_compat: bool = False) -> list[Finding]:
    """Return the findings for a PDDL file; for a problem, also errors in its domain and doubts about it.

    :param text: the text to check instead of the file's content.
    :param fawkes_compat: see :func:`~cxbridge.executive.pddl.parse_domain`.
    """
    findings: list[Finding] = []

    def warn(mistake: PddlError) -> None:
        findings.append(make_error_finding(mistake, DUBIOUS_DOMAIN))

    try:
        text = read_text(file, "PDDL file") if text is None else text
        domain_name = _find_domain_name(text, Use.NAMED)
        if not domain_name:  # only problems refer to a domain, so the file is a domain
            domain = parse_domain(text, file, fawkes_compat=fawkes_compat, warn=warn)
            # Without a problem, any predicate may be true at the start.
            return [*findings, *doubts.make_findings(str(file), doubts.find_domain_doubts(domain))]
        path = _find_domain_file(file, domain_name)
        if path is None:
            message = f"there is no domain {domain_name} beside the problem"
            return [Finding(MISSING_DOMAIN, SourcePlace(str(file)), message)]
        domain = load_domain(path, fawkes_compat=fawkes_compat)
        findings += _check_problem(file, parse_problem(text, domain, file, warn=warn), domain)
    except PddlError as error:
        findings.append(make_error_finding(error, WRONG_DOMAIN))
    return findings


def _check_problem(file: Path, problem: Problem, domain: Domain) -> Iterator[Finding]:
    """Yield the doubts about a problem, and about its domain with the facts of the problem."""
    initial_predicates = {atom.predicate for atom in problem.init}
    yield from doubts.make_findings(str(file), doubts.find_object_doubts(domain, problem.objects))
    yield from doubts.make_findings(domain.file, doubts.find_domain_doubts(domain, initial_predicates))
    yield from doubts.make_findings(
        str(file), doubts.find_goal_doubts(domain, problem.goal, initial_predicates)
    )


def _find_domain_file(problem: Path, name: str) -> Path | None:
    """Return the file in a problem's folder that defines a domain; None if there is none.

    PDDL ignores the case of names.
    """
    for path in sorted(problem.parent.glob(f"*{PDDL_SUFFIX}")):
        with suppress(PddlError):  # the folder may contain unreadable files, which are not the domain
            defined_name = _find_domain_name(read_text(path, "PDDL file"), Use.DEFINED)
            if path != problem and defined_name.lower() == name.lower():
                return path
    return None


def _find_domain_name(text: str, use: Use) -> str:
    """Return the name of the domain that a PDDL text defines or names; empty if there is none."""
    mentions = read_pddl("", text).mentions
    names = (mention.name for mention in mentions if mention.use is use)
    return next((name.text for name in names if name.kind is NameKind.DOMAIN), "")
