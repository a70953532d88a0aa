"""Slots of a fact that are read after it was retracted, as CLIPS 6.30 allows.

There ``(do-for-all-facts ((?w item)) TRUE (retract ?w) (printout t ?w:name crlf))`` prints names: the values
of a fact live until the rule is done. In 6.4 it is an error that ends the right-hand side. Agents clean up
that way. So a slot that the body of a query reads behind a ``retract`` or ``modify`` of its fact is read
where the body begins, where it is what 6.30 would read later: ``?w:name`` becomes a variable that is bound
there.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, read

_QUERIES: Final = frozenset({"do-for-fact", "do-for-all-facts", "delayed-do-for-all-facts"})
_ENDS: Final = frozenset({"retract", "modify"})
_LIKELY: Final = re.compile(r"do-for-(?:all-)?facts?\b(?=.*\(\s*(?:retract|modify)\b.*:)", re.DOTALL)
_LEAST_ARGUMENTS: Final = 3

Edit = tuple[int, int, str]
"""From, to, and the replacement."""


def kept_slots(code: str, start: int, end: int) -> list[Edit]:
    """Return the edits that let a construct read slots of facts which it has retracted.

    :param code: of a file, with blanks for its strings and comments.
    :param start: where the construct begins.
    :param end: where it ends.
    """
    if _LIKELY.search(code, start, end) is None:
        return []
    return [
        (start + first, start + last, new)
        for node in read(code[start:end])
        for each in node.walk()
        if each.head in _QUERIES
        for first, last, new in _edits(each)
    ]


def _edits(query: SyntaxNode) -> Iterator[Edit]:
    arguments = query.arguments
    if len(arguments) < _LEAST_ARGUMENTS:
        return
    variables = [each.head for each in arguments[0].items or ()]
    body = arguments[2:]
    for variable in variables:
        gone = _end_of(variable, body)
        slots: dict[str, str] = {}
        for node in _words(body):
            name, colon, slot = node.text.partition(":")
            if gone is not None and node.start > gone and name == variable and colon and slot:
                slots[slot] = f"?cx-{variable[1:]}-{slot}"
                yield node.start, node.end, slots[slot]
        if slots:
            bound = "".join(f"(bind {new} {variable}:{slot}) " for slot, new in slots.items())
            yield body[0].start, body[0].start, bound


def _end_of(variable: str, body: tuple[SyntaxNode, ...]) -> int | None:
    """Return where the fact of a variable is retracted first; None: nowhere."""
    calls = (node for each in body for node in each.walk() if node.head in _ENDS)
    return next((call.end for call in calls if any(each.text == variable for each in call.arguments)), None)


def _words(body: tuple[SyntaxNode, ...]) -> Iterator[SyntaxNode]:
    for each in body:
        yield from (node for node in each.walk() if node.items is None)
