"""Access to slots of retracted facts, as in CLIPS 6.30.

Agents clean up with queries such as ``(do-for-all-facts ((?w item)) TRUE (retract ?w) (printout t ?w:name
crlf))``. In 6.30 this query prints names, because a fact's values live until the rule ends. In 6.4 the query
is an error that ends the right-hand side. Therefore the host lets the body start with ``(bind ?cx-w-name
?w:name)``, and replaces each ``?w:name`` after the ``retract`` or ``modify`` of ``?w`` by ``?cx-w-name``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, read_nodes

_QUERY_FUNCTIONS: Final = frozenset({"do-for-fact", "do-for-all-facts", "delayed-do-for-all-facts"})
_RETRACTING_FUNCTIONS: Final = frozenset({"retract", "modify"})
# most constructs have no such query: a search by this pattern is much faster than reading the construct
_QUERY_WITH_RETRACTION: Final = re.compile(
    r"do-for-(?:all-)?facts?\b(?=.*\(\s*(?:retract|modify)\b.*:)", re.DOTALL
)

Edit = tuple[int, int, str]
"""A change of a text: start and end of the replaced part, and the replacement."""


def find_retracted_slot_edits(code: str, start: int, end: int) -> list[Edit]:
    """Return the edits that preserve the slots of retracted facts in a construct.

    :param code: the file's text with strings and comments blanked.
    """
    if _QUERY_WITH_RETRACTION.search(code, start, end) is None:
        return []
    return [
        (start + edit_start, start + edit_end, text)
        for node in read_nodes(code[start:end])
        for query in node.walk()
        if query.head in _QUERY_FUNCTIONS
        for edit_start, edit_end, text in _find_query_edits(query)
    ]


def _find_query_edits(query: SyntaxNode) -> Iterator[Edit]:
    # the arguments are the variables, the condition and the actions; an invalid query may lack some
    variables = [item.head for declaration in query.arguments[:1] for item in declaration.items or ()]
    body = query.arguments[2:]
    for variable in variables:
        retraction_end = _find_retraction_end(variable, body)
        slots: dict[str, str] = {}
        for node in (node for action in body for node in action.walk() if node.items is None):
            name, colon, slot = node.text.partition(":")
            follows_retraction = retraction_end is not None and node.start > retraction_end
            if follows_retraction and name == variable and colon and slot:
                slots[slot] = f"?cx-{variable[1:]}-{slot}"
                yield node.start, node.end, slots[slot]
        if slots:
            bindings = "".join(f"(bind {name} {variable}:{slot}) " for slot, name in slots.items())
            yield body[0].start, body[0].start, bindings


def _find_retraction_end(variable: str, body: tuple[SyntaxNode, ...]) -> int | None:
    """Return the end of the first call that retracts a variable's fact, or None."""
    calls = (node for action in body for node in action.walk() if node.head in _RETRACTING_FUNCTIONS)
    return next(
        (call.end for call in calls if any(argument.text == variable for argument in call.arguments)), None
    )
