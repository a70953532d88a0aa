"""Finds constructs that are defined twice: the later one replaces the first, without a word."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from cxbridge.clipstext.syntax import is_declaration
from cxbridge_studio.check.agent import Agent
from cxbridge_studio.check.findings import Code, Finding, Severity, SourcePlace
from cxbridge_studio.check.lost import Losses
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
    """Yield a finding for each construct of the agent that replaces another one."""
    losses = Losses(agent.usage, agent.is_of_core)
    first: dict[tuple[str, str, str], Construct] = {}
    module = "MAIN"
    for construct in agent.usage.constructs:
        module = construct.module or module  # CLIPS stays in the last named module
        key = construct.keyword, construct.name
        if construct.keyword not in _KINDS or not construct.name:
            continue
        before = first.setdefault((*key, module), construct)
        if is_declaration(before.placed.piece.text):
            first[*key, module] = construct  # a declaration, for functions that call each other
            continue
        here = construct.file
        if before is construct or agent.is_of_core(here.path) or (here.path, *key) in agent.dropped:
            continue
        start = construct.placed.start
        line = before.file.lines.at(before.placed.start)
        where = "line" if before.file is here else f"{Path(before.file.path).name}, line"
        place = SourcePlace(here.path, here.lines.at(start), here.lines.column(start))
        lost = losses.of([before])
        message = f"{construct.keyword} {construct.name} replaces the one in {where} {line}"
        message += f"; {lost}" if lost else ""
        yield Finding(TWICE, place, message, "rename or remove one")
