"""Checks the slots of facts in variables, and the values that rules give them.

CLIPS checks these slots only when the rule fires, and the values in changes never.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from cxbridge.clipstext.syntax import literal, read_nodes
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.agent.names import Mention, NameKind, Use
from cxbridge_studio.check.agent import Agent
from cxbridge_studio.check.findings import Code, Finding, Severity
from cxbridge_studio.check.usage import Construct

UNKNOWN_SLOT: Final = Code(
    "CX210",
    Severity.ERROR,
    "a slot that a fact in a variable does not have",
    "A modify, a duplicate or ?fact:slot names a slot that the deftemplate of the fact lacks. CLIPS does not "
    "notice the mistake when it reads the rule: the action fails each time the rule fires.",
)
FORBIDDEN_VALUE: Final = Code(
    "CX211",
    Severity.ERROR,
    "a value that the slot does not allow",
    "A modify or a duplicate gives a slot a value that its deftemplate does not allow. CLIPS "
    "checks values only in assert and in patterns: the fact gets the value, which no literal in a pattern "
    "matches.",
)

CODES: Final = (UNKNOWN_SLOT, FORBIDDEN_VALUE)

# The uses of a slot of a fact in a variable. CLIPS itself checks the slots in patterns and assertions.
_VARIABLE_USES: Final = frozenset({Use.CHANGED, Use.QUERIED})


def check(agent: Agent) -> Iterator[Finding]:
    """Yield a finding for each slot that the deftemplate of a fact lacks, and each value that it forbids."""
    slots = agent.slots
    for construct in agent.usage.constructs:
        for mention in construct.placed_piece.piece.mentions if agent.is_loaded(construct) else ():
            # The owner, the deftemplate of the fact, is empty if the fact is ambiguous.
            name, owner = mention.name.text, mention.name.owner
            if (
                mention.name.kind is not NameKind.SLOT
                or mention.use not in _VARIABLE_USES
                or owner not in slots
            ):
                continue
            if name not in slots[owner]:
                yield Finding(
                    UNKNOWN_SLOT,
                    construct.place(mention.start),
                    f"{_format_construct(construct)}the deftemplate '{owner}' has no slot '{name}'",
                    did_you_mean(name, slots[owner], f"it has: {', '.join(sorted(slots[owner]))}"),
                )
            elif mention.use is Use.CHANGED:
                yield from _find_forbidden_values(agent, construct, mention)


def _find_forbidden_values(agent: Agent, construct: Construct, mention: Mention) -> Iterator[Finding]:
    """Yield a finding for each literal value that the slot in a change does not allow."""
    slot, template = mention.name.text, mention.name.owner
    allowed_values = agent.allowed_values(template, slot)
    text = construct.placed_piece.piece.text
    # The parenthesis before the slot's name begins the list with the values.
    list_start = text.rfind("(", 0, mention.start)
    for value in read_nodes(text[list_start:], close=True)[0].arguments if allowed_values else ():
        if (word := literal(value)) and word not in allowed_values:
            yield Finding(
                FORBIDDEN_VALUE,
                construct.place(list_start + value.start),
                f"{_format_construct(construct)}the slot '{slot}' of '{template}' cannot be {word}",
                did_you_mean(word, allowed_values, f"it can be: {', '.join(sorted(allowed_values))}"),
            )


def _format_construct(construct: Construct) -> str:
    return f"{construct.keyword} {construct.name}: " if construct.name else ""
