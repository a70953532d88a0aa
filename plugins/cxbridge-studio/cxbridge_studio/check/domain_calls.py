"""The PDDL domains that an agent's CLIPS files parse, and the goals that the files give to planners."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, literal
from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.executive.features.pddl_parser import reads_as_fawkes
from cxbridge.executive.pddl import Domain, load_domain, pairs_of
from cxbridge_studio.check.agent import Agent, ClipsFile, read_first_argument

MIN_PREDICATE_LIKENESS: Final = 0.75
"""The minimum similarity with which a predicate counts as a misspelling of a declared predicate.

It is higher than the minimum for suggestions: findings depend on it, not only hints.
"""

_PLANNER_FUNCTIONS: Final = ("planner-plan", "planner-plan-with", "planner-plan-part")


@dataclass(slots=True)
class DomainCall:
    """A call of ``parse-pddl-domain``.

    :param file: the CLIPS file with the call.
    :param node: the call.
    :param name: the name of the domain's file; empty if the name is computed at run time.
    :param path: the domain's file; None if no folder contains the file, or the name is computed.
    :param domain: the domain; None if ``path`` is None, or the domain cannot be read.
    :param error: the reason why the domain cannot be read; None if it is read, missing or computed.
    :param warnings: the mistakes that the parser tolerates.
    """

    file: ClipsFile
    node: SyntaxNode
    name: str
    path: Path | None = None
    domain: Domain | None = None
    error: CxbridgeError | None = None
    warnings: list[PddlError] = field(default_factory=list)


def find_domain_calls(agent: Agent) -> Iterator[DomainCall]:
    """Yield the calls that parse a domain, each with its domain."""
    fawkes_compat = reads_as_fawkes(agent.config)
    for file in agent.own_files:
        for node in file.find_calls("parse-pddl-domain"):
            call = DomainCall(file, node, read_first_argument(node))
            call.path = agent.find_file(call.name) if call.name else None
            try:
                if call.path is not None:
                    call.domain = load_domain(
                        call.path, fawkes_compat=fawkes_compat, warn=call.warnings.append
                    )
            except CxbridgeError as error:
                # Only the check of domains reports the error; the other checks skip such a domain.
                call.error = error
            yield call


def find_domain_files(agent: Agent) -> list[Path]:
    """Return the existing files of the domains, each once."""
    return list(dict.fromkeys(call.path for call in find_domain_calls(agent) if call.path is not None))


def read_domains(agent: Agent) -> list[Domain]:
    """Return the domains; empty if one of them is missing, has a computed name, or cannot be read."""
    domains = [call.domain for call in find_domain_calls(agent)]
    return [domain for domain in domains if domain is not None] if None not in domains else []


def find_planner_goals(agent: Agent) -> Iterator[tuple[ClipsFile, SyntaxNode, str]]:
    """Yield the CLIPS file, the call and the goal of each planner call. A computed goal is empty."""
    for file in agent.own_files:
        for call in file.find_calls(*_PLANNER_FUNCTIONS):
            yield file, call, literal(call.arguments[1]) if len(call.arguments) > 1 else ""


def find_objects(agent: Agent, domains: list[Domain]) -> set[str] | None:
    """Return the objects of the domains and of rules; None if any object is possible.

    Any object is possible if rules compute the names of objects, or if objects come from other sources than
    rules.
    """
    facts = agent.own_facts("domain-object")
    if not facts or any("name" not in fact.words_by_slot for fact in facts):
        return None
    if any("objects-by-type" in file.text for file in agent.own_files):
        return None  # facts of the world model list objects
    constants = {name for domain in domains for name, _ in pairs_of(domain.constants)}
    return constants.union(*(fact.words_by_slot["name"] for fact in facts))
