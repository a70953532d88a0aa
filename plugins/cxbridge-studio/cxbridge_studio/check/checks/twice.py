"""Checks for constructs that are defined twice: CLIPS replaces the first construct without a message."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from cxbridge.clipstext.syntax import is_declaration
from cxbridge_studio.check.agent import Agent
from cxbridge_studio.check.findings import Code, Finding, Severity
from cxbridge_studio.check.usage import Construct

DUPLICATE_CONSTRUCT: Final = Code(
    "CX208",
    Severity.WARNING,
    "a construct is defined twice",
    "The later construct replaces the earlier one, in the same file or in another: only one of "
    "two rules with one name exists.",
)

CODES: Final = (DUPLICATE_CONSTRUCT,)

# The compared constructs. A defglobal defines several names, and the methods of a function share its name.
_KEYWORDS: Final = frozenset({"defrule", "deftemplate", "deffacts", "deffunction", "defgeneric", "defclass"})


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the constructs of the agent that replace an earlier construct."""
    constructs_by_key: dict[tuple[str, str, str], Construct] = {}
    module = "MAIN"
    for construct in agent.usage.constructs:
        module = construct.module or module  # a construct without a module belongs to the last named module
        key = construct.keyword, construct.name
        if construct.keyword not in _KEYWORDS or not construct.name:
            continue
        earlier_construct = constructs_by_key.setdefault((*key, module), construct)
        if is_declaration(earlier_construct.placed_piece.piece.text):
            # A forward declaration, which functions that call each other need, may be replaced.
            constructs_by_key[*key, module] = construct
            continue
        file, earlier_file = construct.file, earlier_construct.file
        if earlier_construct is construct or agent.is_core_path(file.path) or not agent.is_loaded(construct):
            continue
        file_text = "" if earlier_file is file else f"{Path(earlier_file.path).name}, "
        yield Finding(
            DUPLICATE_CONSTRUCT,
            construct.place(),
            f"{construct.keyword} {construct.name} replaces the definition in {file_text}"
            f"line {earlier_construct.place().line}",
            "rename or remove one of them",
        )
