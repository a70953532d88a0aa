"""Check for slots and values in changes of facts that CLIPS itself checks too late or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from cxbridge.clipstext.syntax import literal, read
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.agent.names import Mention, NameKind, PlacedPiece, SourceFile, Use
from cxbridge_studio.check.agent import Agent
from cxbridge_studio.check.findings import Code, Finding, Severity, SourcePlace

SLOT: Final = Code(
    "CX210",
    Severity.ERROR,
    "a slot that a fact in a variable does not have",
    "A modify, a duplicate or ?fact:slot names a slot that the deftemplate of the fact lacks. CLIPS does not "
    "see that when it reads the rule: the action fails each time the rule fires.",
)
VALUE: Final = Code(
    "CX211",
    Severity.ERROR,
    "a value that the slot does not allow",
    "A modify or a duplicate gives a slot a value that its deftemplate does not allow. CLIPS "
    "checks values only in assert and in patterns: the fact gets the value, and no rule matches it.",
)

CODES: Final = (SLOT, VALUE)

_USES: Final = frozenset({Use.CHANGED, Use.QUERIED})


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the slots and values that the deftemplate of the variable's fact does not allow."""
    slots = agent.slots
    for construct in agent.usage.constructs:
        file, placed = construct.file, construct.placed
        if (file.path, construct.keyword, construct.name) in agent.dropped or not placed.piece.closed:
            continue
        for mention in placed.piece.mentions:
            owner = mention.name.owner
            if mention.name.kind is not NameKind.SLOT or mention.use not in _USES or owner not in slots:
                continue
            if mention.name.text not in slots[owner]:
                yield _unknown(file, placed, mention, slots[owner])
            elif mention.use is Use.CHANGED:
                yield from _values(agent, file, placed, mention)


def _place(file: SourceFile, offset: int) -> SourcePlace:
    return SourcePlace(file.path, file.lines.at(offset), file.lines.column(offset))


def _unknown(file: SourceFile, placed: PlacedPiece, mention: Mention, slots: set[str]) -> Finding:
    name, owner = mention.name.text, mention.name.owner
    hint = did_you_mean(name, slots) or f"it has: {', '.join(sorted(slots))}"
    message = f"{_named(placed)}the deftemplate '{owner}' has no slot '{name}'"
    return Finding(SLOT, _place(file, placed.start + mention.start), message, hint)


def _values(agent: Agent, file: SourceFile, placed: PlacedPiece, mention: Mention) -> Iterator[Finding]:
    known = agent.allowed(mention.name.owner, mention.name.text)
    if not known:
        return
    begin = placed.piece.text.rfind("(", 0, mention.start)
    for value in read(placed.piece.text[begin:], close=True)[0].arguments:
        word = literal(value)
        if word and word not in known:
            message = (
                f"{_named(placed)}the slot '{mention.name.text}' of '{mention.name.owner}' cannot be {word}"
            )
            hint = did_you_mean(word, known) or f"it can be: {', '.join(sorted(known))}"
            yield Finding(VALUE, _place(file, placed.start + begin + value.start), message, hint)


def _named(placed: PlacedPiece) -> str:
    name = placed.piece.name
    return "" if name is None else f"{placed.piece.keyword} {name.text}: "
