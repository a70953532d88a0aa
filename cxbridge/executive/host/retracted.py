"""Access to slots of retracted facts, as in CLIPS 6.30.

``(do-for-all-facts ((?w item)) TRUE (retract ?w) (printout t ?w:name crlf))`` prints names in 6.30, where a
fact's values live until the rule ends. In 6.4 it is an error that ends the right-hand side, but agents clean
up this way. Therefore each slot that a query's body reads after the ``retract`` or ``modify`` of its fact is
read at the start of the body: ``?w:name`` becomes a variable bound there.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, read

_QUERIES: Final = frozenset({"do-for-fact", "do-for-all-facts", "delayed-do-for-all-facts"})
_RETRACTING: Final = frozenset({"retract", "modify"})
_LIKELY: Final = re.compile(r"do-for-(?:all-)?facts?\b(?=.*\(\s*(?:retract|modify)\b.*:)", re.DOTALL)
_MIN_ARGUMENTS: Final = 3  # the variables, the condition and one action

Edit = tuple[int, int, str]
"""Start, end and replacement."""


def slot_edits(code: str, start: int, end: int) -> list[Edit]:
    """Return the edits that preserve the slots of retracted facts in a construct.

    :param code: the file's text with strings and comments blanked.
    """
    if _LIKELY.search(code, start, end) is None:
        return []
    return [
        (start + edit_start, start + edit_end, text)
        for node in read(code[start:end])
        for query in node.walk()
        if query.head in _QUERIES
        for edit_start, edit_end, text in _edits(query)
    ]


def _edits(query: SyntaxNode) -> Iterator[Edit]:
    arguments = query.arguments
    if len(arguments) < _MIN_ARGUMENTS:
        return
    variables = [item.head for item in arguments[0].items or ()]
    body = arguments[2:]
    for variable in variables:
        retracted_at = _end_of(variable, body)
        slots: dict[str, str] = {}
        for node in _body_words(body):
            name, colon, slot = node.text.partition(":")
            is_late = retracted_at is not None and node.start > retracted_at
            if is_late and name == variable and colon and slot:
                slots[slot] = f"?cx-{variable[1:]}-{slot}"
                yield node.start, node.end, slots[slot]
        if slots:
            bindings = "".join(f"(bind {name} {variable}:{slot}) " for slot, name in slots.items())
            yield body[0].start, body[0].start, bindings


def _end_of(variable: str, body: tuple[SyntaxNode, ...]) -> int | None:
    """Return the end of the first call that retracts a variable's fact, or None."""
    calls = (node for action in body for node in action.walk() if node.head in _RETRACTING)
    return next(
        (call.end for call in calls if any(argument.text == variable for argument in call.arguments)), None
    )


def _body_words(body: tuple[SyntaxNode, ...]) -> Iterator[SyntaxNode]:
    for action in body:
        yield from (node for node in action.walk() if node.items is None)
