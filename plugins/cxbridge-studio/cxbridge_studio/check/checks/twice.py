"""Checks for constructs that are defined twice: CLIPS silently replaces the first construct."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from cxbridge.clipstext.syntax import is_declaration
from cxbridge_studio.check.agent import Agent
from cxbridge_studio.check.findings import Code, Finding, Severity
from cxbridge_studio.check.losses import LossFinder
from cxbridge_studio.check.usage import Construct

TWICE: Final = Code(
    "CX208",
    Severity.WARNING,
    "a construct is defined twice",
    "The later construct replaces the earlier one, in the same file or in another: only one of "
    "two rules with one name exists.",
)

CODES: Final = (TWICE,)

_KINDS: Final = frozenset({"defrule", "deftemplate", "deffacts", "deffunction", "defgeneric", "defclass"})


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the constructs of the agent that replace an earlier construct."""
    loss_finder = LossFinder(agent.usage, agent.own_constructs)
    definitions: dict[tuple[str, str, str], Construct] = {}
    module = "MAIN"
    for construct in agent.usage.constructs:
        module = construct.module or module  # the last named module stays the current module of CLIPS
        key = construct.keyword, construct.name
        if construct.keyword not in _KINDS or not construct.name:
            continue
        earlier = definitions.setdefault((*key, module), construct)
        if is_declaration(earlier.placed.piece.text):
            # Functions that call each other need a forward declaration, which may be replaced.
            definitions[*key, module] = construct
            continue
        file = construct.file
        if earlier is construct or agent.is_of_core(file.path) or (file.path, *key) in agent.dropped:
            continue
        where = "line" if earlier.file is file else f"{Path(earlier.file.path).name}, line"
        losses = loss_finder.of([earlier])
        message = f"{construct.keyword} {construct.name} replaces the one in {where} {earlier.place().line}"
        message += f"; {losses}" if losses else ""
        yield Finding(TWICE, construct.place(), message, "rename or remove one")
