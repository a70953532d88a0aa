"""Checks the slots and values in changes of facts.

CLIPS checks the slots only when the rule fires, and the values never.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from cxbridge.clipstext.syntax import literal, read
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
    "checks values only in assert and in patterns: the fact gets the value, and no rule matches it.",
)

CODES: Final = (UNKNOWN_SLOT, FORBIDDEN_VALUE)

# The uses of a slot of a fact in a variable. CLIPS itself checks the slots in patterns and assertions.
_VARIABLE_USES: Final = frozenset({Use.CHANGED, Use.QUERIED})


def check(agent: Agent) -> Iterator[Finding]:
    """Yield a finding for each slot or value that the deftemplate of the changed or read fact lacks."""
    slots = agent.slots
    for construct in agent.usage.constructs:
        piece = construct.placed.piece
        key = construct.file.path, construct.keyword, construct.name
        # Another check reports dropped constructs, and the end of an unclosed construct is a guess.
        if key in agent.dropped_constructs or not piece.is_closed:
            continue
        for mention in piece.mentions:
            owner = mention.name.owner  # empty if the template of the variable's fact is ambiguous
            if (
                mention.name.kind is not NameKind.SLOT
                or mention.use not in _VARIABLE_USES
                or owner not in slots
            ):
                continue
            if mention.name.text not in slots[owner]:
                yield _make_unknown_slot_finding(construct, mention, slots[owner])
            elif mention.use is Use.CHANGED:
                yield from _find_forbidden_values(agent, construct, mention)


def _make_unknown_slot_finding(construct: Construct, mention: Mention, slots: set[str]) -> Finding:
    name, owner = mention.name.text, mention.name.owner
    hint = did_you_mean(name, slots) or f"it has: {', '.join(sorted(slots))}"
    message = f"{_format_construct(construct)}the deftemplate '{owner}' has no slot '{name}'"
    return Finding(UNKNOWN_SLOT, construct.place(mention.start), message, hint)


def _find_forbidden_values(agent: Agent, construct: Construct, mention: Mention) -> Iterator[Finding]:
    """Yield a finding for each literal value that the slot in a change does not allow."""
    slot, template = mention.name.text, mention.name.owner
    allowed = agent.allowed_values(template, slot)
    text = construct.placed.piece.text
    # The parenthesis before the slot's name begins the list with the values.
    list_start = text.rfind("(", 0, mention.start)
    for value in read(text[list_start:], close=True)[0].arguments if allowed else ():
        word = literal(value)
        if word and word not in allowed:
            message = f"{_format_construct(construct)}the slot '{slot}' of '{template}' cannot be {word}"
            hint = did_you_mean(word, allowed) or f"it can be: {', '.join(sorted(allowed))}"
            yield Finding(FORBIDDEN_VALUE, construct.place(list_start + value.start), message, hint)


def _format_construct(construct: Construct) -> str:
    return f"{construct.keyword} {construct.name}: " if construct.name else ""
