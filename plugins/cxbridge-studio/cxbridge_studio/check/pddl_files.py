"""Check of a PDDL file without an agent: a domain, or a problem with a domain in the same folder."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from cxbridge.errors import PddlError
from cxbridge.executive.pddl import Domain, Problem, load_domain, parse_domain, parse_problem
from cxbridge.executive.pddl.decoding import read_text
from cxbridge_studio.check.checks.domain import DOMAIN, DUBIOUS, NO_DOMAIN
from cxbridge_studio.check.checks.domain_doubts import BY_KIND
from cxbridge_studio.check.doubts import Doubt, doubts, unachieved, untyped_objects
from cxbridge_studio.check.findings import Finding, SourcePlace, of_error

SUFFIX: Final = ".pddl"
_DOMAIN_OF: Final = re.compile(r"\(\s*:domain\s+([^\s()]+)\s*\)", re.IGNORECASE)
_NAME_OF: Final = re.compile(r"\(\s*domain\s+([^\s()]+)\s*\)", re.IGNORECASE)
_COMMENT: Final = re.compile(r";[^\n]*")


def findings_of(file: Path, text: str | None = None, *, fawkes_compat: bool = False) -> list[Finding]:
    """Return the mistakes of a PDDL file.

    :param text: the text to check instead of the file's content.
    :param fawkes_compat: see :func:`~cxbridge.executive.pddl.parse_domain`.
    """
    found: list[Finding] = []

    def warn(mistake: PddlError) -> None:
        found.append(of_error(mistake, DUBIOUS))

    try:
        text = read_text(file, "PDDL file") if text is None else text
        wanted = _DOMAIN_OF.search(_COMMENT.sub("", text))
        if wanted is None:
            domain = parse_domain(text, file, fawkes_compat=fawkes_compat, warn=warn)
            return [*found, *_findings(file, doubts(domain))]
        path = _find_domain(file, wanted[1])
        if path is None:
            message = f"there is no domain {wanted[1]} beside the problem"
            return [Finding(NO_DOMAIN, SourcePlace(str(file)), message)]
        domain = load_domain(path, fawkes_compat=fawkes_compat)
        found += _of_problem(file, parse_problem(text, domain, file, warn=warn), domain)
    except PddlError as error:
        found.append(of_error(error, DOMAIN))
    return found


def _of_problem(file: Path, problem: Problem, domain: Domain) -> Iterator[Finding]:
    made = {atom.predicate for atom in problem.init}
    yield from _findings(file, untyped_objects(domain, problem.objects))
    yield from _findings(Path(domain.file), doubts(domain, made))
    yield from _findings(file, unachieved(domain, problem.goal, made))


def _findings(file: Path, found: Iterator[Doubt]) -> Iterator[Finding]:
    for doubt in found:
        place = SourcePlace(str(file), doubt.position.line, doubt.position.column)
        yield Finding(BY_KIND[doubt.kind], place, doubt.message)


def _find_domain(problem: Path, name: str) -> Path | None:
    """Return the domain file for a problem from the same folder."""
    for path in sorted(problem.parent.glob(f"*{SUFFIX}")):
        try:
            match = _NAME_OF.search(_code(path))
        except PddlError:
            continue
        if path != problem and match is not None and match[1].lower() == name.lower():
            return path
    return None


def _code(file: Path) -> str:
    return _COMMENT.sub("", read_text(file, "PDDL file"))
