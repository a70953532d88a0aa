"""The PDDL domains that an agent's CLIPS files parse, and the goals that they give to planners."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, literal
from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.executive.features.pddl_parser import reads_as_fawkes
from cxbridge.executive.pddl import Domain, load_domain
from cxbridge_studio.check.agent import Agent, ClipsFile, literal_text

_PARSE: Final = "parse-pddl-domain"
_PLANNERS: Final = ("planner-plan", "planner-plan-with", "planner-plan-part")


@dataclass(slots=True)
class DomainCall:
    """A call of ``parse-pddl-domain``.

    :param name: the name of the domain's file; empty if it is computed at run time.
    :ivar path: the file; None if no folder has it.
    :ivar domain: None if the domain cannot be read.
    :ivar error: why the domain cannot be read.
    :ivar warnings: mistakes in spite of which the domain is read.
    """

    file: ClipsFile
    node: SyntaxNode
    name: str
    path: Path | None = None
    domain: Domain | None = None
    error: CxbridgeError | None = None
    warnings: list[PddlError] = field(default_factory=list)


def domain_calls(agent: Agent) -> Iterator[DomainCall]:
    """Yield the calls that parse a domain, with the domains."""
    fawkes_compat = reads_as_fawkes(agent.config)
    for file in agent.own_files:
        for node in file.calls(_PARSE):
            call = DomainCall(file, node, literal_text(node.arguments[0]) if node.arguments else "")
            call.path = agent.find(call.name) if call.name else None
            if call.path is not None:
                try:
                    call.domain = load_domain(
                        call.path, fawkes_compat=fawkes_compat, warn=call.warnings.append
                    )
                except CxbridgeError as error:
                    # Kept for one check alone: the others skip a domain that cannot be read.
                    call.error = error
            yield call


def planner_goals(agent: Agent) -> Iterator[tuple[ClipsFile, SyntaxNode, str]]:
    """Yield the planner calls, each with its file and the text of its goal; empty if the goal is computed."""
    for file in agent.own_files:
        for call in file.calls(*_PLANNERS):
            yield file, call, literal(call.arguments[1]) if len(call.arguments) > 1 else ""
