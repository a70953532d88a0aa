"""Checks one PDDL file without an agent: a domain, or a problem with the domain beside it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from cxbridge.errors import PddlError
from cxbridge.executive.pddl import Domain, load_domain, load_problem
from cxbridge.executive.pddl.decoding import read_text
from cxbridge_studio.check.checks.domain import DOMAIN, DUBIOUS, NO_DOMAIN
from cxbridge_studio.check.checks.domain_doubts import BY_KIND
from cxbridge_studio.check.doubts import Doubt, doubts, unachieved, untyped_objects
from cxbridge_studio.check.findings import Finding, SourcePlace, of_error

SUFFIX: Final = ".pddl"
_DOMAIN_OF: Final = re.compile(r"\(\s*:domain\s+([^\s()]+)\s*\)", re.IGNORECASE)
_NAME_OF: Final = re.compile(r"\(\s*domain\s+([^\s()]+)\s*\)", re.IGNORECASE)
_COMMENT: Final = re.compile(r";[^\n]*")


def findings_of(file: Path) -> list[Finding]:
    """Return what is wrong with a PDDL file."""
    found: list[Finding] = []

    def warn(mistake: PddlError) -> None:
        found.append(of_error(mistake, DUBIOUS))

    try:
        wanted = _DOMAIN_OF.search(_code(file))
        if wanted is None:
            domain = load_domain(file, warn=warn)
            return [*found, *_findings(file, doubts(domain))]
        path = _find_domain(file, wanted[1])
        if path is None:
            message = f"there is no domain {wanted[1]} beside the problem"
            return [Finding(NO_DOMAIN, SourcePlace(str(file)), message)]
        found += _of_problem(file, load_domain(path), warn)
    except PddlError as error:
        found.append(of_error(error, DOMAIN))
    return found


def _of_problem(file: Path, domain: Domain, warn: Callable[[PddlError], None]) -> Iterator[Finding]:
    problem = load_problem(file, domain, warn=warn)
    made = {atom.predicate for atom in problem.init}
    yield from _findings(file, untyped_objects(domain, problem.objects))
    yield from _findings(Path(domain.file), doubts(domain, made))
    yield from _findings(file, unachieved(domain, problem.goal, made))


def _findings(file: Path, found: Iterator[Doubt]) -> Iterator[Finding]:
    for doubt in found:
        place = SourcePlace(str(file), doubt.position.line, doubt.position.column)
        yield Finding(BY_KIND[doubt.kind], place, doubt.message)


def _find_domain(problem: Path, name: str) -> Path | None:
    """Return the file beside a problem that has the domain of a name."""
    for path in sorted(problem.parent.glob(f"*{SUFFIX}")):
        try:
            found = _NAME_OF.search(_code(path))
        except PddlError:
            continue
        if path != problem and found is not None and found[1].lower() == name.lower():
            return path
    return None


def _code(file: Path) -> str:
    return _COMMENT.sub("", read_text(file, "PDDL file"))
