"""Explanations of syntax errors.

The parser only knows an unexpected token and the permitted terminals. The brackets around the token
(:mod:`.brackets`) show a missing bracket, an unsupported part of PDDL, or a file of the wrong kind.
"""

from __future__ import annotations

from typing import Final

from cxbridge.executive.pddl.ast import Position
from cxbridge.executive.pddl.brackets import Group, Item, parse_items, token_words
from cxbridge.executive.pddl.errors import PddlSyntaxError, syntax_error
from cxbridge.executive.pddl.grammar import load_tables
from cxbridge.executive.pddl.reader import UnexpectedToken
from cxbridge.executive.pddl.tokens import SourceText
from cxbridge.executive.pddl.unsupported import unsupported_formula, unsupported_section, unsupported_texts
from cxbridge.suggestions import did_you_mean

_TERMINAL_NOUNS: Final = {
    "NAME": "a name",
    "VARIABLE": "a variable",
    "NUMBER": "a number",
    "LPAR": "'('",
    "RPAR": "')'",
}


def unexpected_token_error(text: SourceText, symbol: str, unexpected: UnexpectedToken) -> PddlSyntaxError:
    """Return the error about an unexpected token.

    :param symbol: the start symbol of the text.
    """
    try:
        items = parse_items(text)
    except PddlSyntaxError as bracket_error:  # a missing bracket explains the token, too
        return bracket_error
    position = text.position(unexpected.token.start)
    enclosing_groups = _find_enclosing_groups(items, position)
    words = token_words(unexpected.token, text)
    word = words[0].text if words else ""
    unsupported_part = _find_unsupported_part(enclosing_groups, word, position)
    if unsupported_part:
        name, position = unsupported_part
        message, hint = unsupported_texts(name)
        return syntax_error(message, position, text.file, hint)
    defined_kind = _find_defined_kind(items)
    if defined_kind in ("domain", "problem") and symbol in ("domain", "problem") and defined_kind != symbol:
        message = f"this is not a {symbol}, but a {defined_kind}"
        return syntax_error(message, position, text.file, "are the files in the other order?")
    context = (
        f" in ({enclosing_groups[-1].head} ...)"
        if enclosing_groups and enclosing_groups[-1].head not in ("", word)
        else ""
    )
    return syntax_error(
        f"unexpected '{word}'{context}" if words else f"unexpected end of the {symbol}",
        position,
        text.file,
        _make_hint(word, unexpected.expected),
    )


def _make_hint(word: str, expected: frozenset[str]) -> str:
    """Return a hint with the similar keyword, or with the permitted keywords and kinds of words.

    Keywords without a colon, such as ``define`` and ``and``, are left out where other words are permitted.

    :param expected: the permitted terminals and rules of the grammar.
    """
    words = sorted(
        keyword
        for keyword, terminal in load_tables().keywords.items()
        if terminal in expected and terminal not in _TERMINAL_NOUNS
    )
    keywords = [keyword for keyword in words if keyword.startswith(":")]
    nouns = [noun for terminal, noun in _TERMINAL_NOUNS.items() if terminal in expected]
    permitted = ", ".join([*keywords, *nouns] or words) or "the end of the text"
    return did_you_mean(word, keywords if nouns else words, f"expected: {permitted}")


def _find_unsupported_part(
    enclosing_groups: list[Group], word: str, position: Position
) -> tuple[str, Position] | None:
    """Return name and position of the outermost unsupported section or formula around a token.

    None if no part around the token is unsupported.
    """
    for group in enclosing_groups:
        if name := unsupported_section(group.head) or unsupported_formula(group.head):
            return name, group.position
    name = unsupported_section(word)  # :derived without its bracket
    return (name, position) if name else None


def _find_defined_kind(items: tuple[Item, ...]) -> str:
    """Return the word in ``(define (WORD NAME)`` in lower case; empty without such a word."""
    define = items[0] if items else None
    header = define.items[1] if isinstance(define, Group) and len(define.items) > 1 else None
    return header.head.lower() if isinstance(header, Group) else ""


def _find_enclosing_groups(items: tuple[Item, ...], position: Position) -> list[Group]:
    """Return the groups that enclose a position, outermost first."""
    enclosing_groups: list[Group] = []
    while True:
        # siblings do not overlap, so at most one group encloses the position
        enclosing_group = next(
            (item for item in items if isinstance(item, Group) and item.position < position <= item.end), None
        )
        if enclosing_group is None:
            return enclosing_groups
        enclosing_groups.append(enclosing_group)
        items = enclosing_group.items
