"""Check for constructs that are defined twice: CLIPS silently replaces the first."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from cxbridge.clipstext.syntax import is_declaration
from cxbridge_studio.check.agent import Agent
from cxbridge_studio.check.findings import Code, Finding, Severity, SourcePlace
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
    losses = LossFinder(agent.usage, agent.is_of_core)
    first: dict[tuple[str, str, str], Construct] = {}
    module = "MAIN"
    for construct in agent.usage.constructs:
        module = construct.module or module  # CLIPS stays in the last named module
        key = construct.keyword, construct.name
        if construct.keyword not in _KINDS or not construct.name:
            continue
        earlier = first.setdefault((*key, module), construct)
        if is_declaration(earlier.placed.piece.text):
            first[*key, module] = construct  # A forward declaration, for functions that call each other.
            continue
        here = construct.file
        if earlier is construct or agent.is_of_core(here.path) or (here.path, *key) in agent.dropped:
            continue
        start = construct.placed.start
        line = earlier.file.lines.at(earlier.placed.start)
        where = "line" if earlier.file is here else f"{Path(earlier.file.path).name}, line"
        place = SourcePlace(here.path, here.lines.at(start), here.lines.column(start))
        lost = losses.of([earlier])
        message = f"{construct.keyword} {construct.name} replaces the one in {where} {line}"
        message += f"; {lost}" if lost else ""
        yield Finding(TWICE, place, message, "rename or remove one")
