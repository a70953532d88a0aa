"""Finds the context of a cursor in CLIPS text: the enclosing lists, and the enclosing fact or pattern."""

from __future__ import annotations

import re

from msgspec import Struct

from cxbridge.clipstext.syntax import HIDDEN, blank
from cxbridge_studio.agent.clips import CONDITION_HEADS
from cxbridge_studio.agent.names import SourceFile
from cxbridge_studio.agent.top_level import find_open_lists

_HEAD = re.compile(r"\(\s*([^\s()\";&|~]*)")
_WORD = re.compile(r"[^\s()\"&|~]*\Z")
_FACT_PARENTS = ("assert", "deffacts", "defrule")  # heads of lists that contain facts or patterns
_NON_FACT_HEADS = ("test", "declare", "assert")  # heads of lists in rules that are neither facts nor patterns
_CHANGE_FUNCTIONS = ("modify", "duplicate")
# the fact in: (modify ?fact
_CHANGED_FACT = re.compile(r"\(\s*\w+\s+(\?[\w-]+)")


class CursorContext(Struct, frozen=True):
    """The context of a cursor.

    :param word: the part of the word before the cursor; in a string, the text from its quote to the cursor.
    :param heads: the heads of the enclosing lists, innermost first, without a list whose head is at the
        cursor.
    :param is_at_head: whether the word is the head of its list.
    :param is_in_condition: whether the cursor is before the arrow of a rule.
    :param template: the template of the enclosing fact or pattern; empty outside of facts and patterns.
    :param text: the construct up to the word.
    :param pattern: the enclosing pattern or fact up to the word.
    """

    word: str
    heads: tuple[str, ...]
    is_at_head: bool
    is_in_condition: bool
    template: str
    text: str
    pattern: str = ""

    @property
    def head(self) -> str:
        """The head of the innermost list; empty at the top level."""
        return self.heads[0] if self.heads else ""


def find_context(file: SourceFile, offset: int) -> CursorContext | None:
    """Return the context of an offset; None in a comment."""
    placed_piece = file.piece_at(offset)
    text_start = placed_piece.start if placed_piece is not None else file.text.rfind("\n", 0, offset) + 1
    text = file.text[text_start:offset]
    hidden_match = next((match for match in HIDDEN.finditer(text) if match.end() == len(text)), None)
    if hidden_match is not None and hidden_match[0].startswith(";"):
        return None
    if hidden_match is not None and hidden_match["unclosed"]:  # the cursor is in a string
        word, text = hidden_match[0][1:], text[: hidden_match.start()]
    else:
        match = _WORD.search(text)
        word = match[0] if match else ""
        text = text[: len(text) - len(word)]
    open_starts = find_open_lists(text)
    is_at_head = bool(open_starts) and not text[open_starts[-1] + 1 :].strip()
    starts = list(reversed(open_starts[:-1] if is_at_head else open_starts))
    heads = tuple(match[1] if (match := _HEAD.match(text, start)) else "" for start in starts)
    template, pattern_start = _find_enclosing_template(text, heads, starts)
    is_in_condition = bool(heads) and heads[-1] == "defrule" and "=>" not in blank(text)
    return CursorContext(
        word, heads, is_at_head, is_in_condition, template, text, text[pattern_start:] if template else ""
    )


def _find_enclosing_template(text: str, heads: tuple[str, ...], starts: list[int]) -> tuple[str, int]:
    """Return the template and the start of the fact or pattern that encloses the end of a text.

    The template is empty if it is unknown, and outside of facts and patterns.

    :param heads: the heads of the lists that enclose the end of the text, innermost first.
    :param starts: the offsets of these lists, in the same order.
    """
    for depth, head in enumerate(heads):
        parent_head = heads[depth + 1] if depth + 1 < len(heads) else ""
        if head in _CHANGE_FUNCTIONS:
            match = _CHANGED_FACT.match(text, starts[depth])
            return find_fact_template(text, match[1]) if match else "", starts[depth]
        has_facts = parent_head in _FACT_PARENTS or parent_head in CONDITION_HEADS
        if has_facts and head not in CONDITION_HEADS and head not in _NON_FACT_HEADS:
            # directly within a rule, a list is a pattern before the arrow, and a call after the arrow
            is_fact = parent_head in ("assert", "deffacts") or "=>" not in blank(text[: starts[depth]])
            return (head, starts[depth]) if is_fact else ("", 0)
    return "", 0


def find_fact_template(text: str, variable: str) -> str:
    """Return the template of the fact that the preceding text binds to a variable; empty if unknown."""
    variable_pattern = re.escape(variable)
    patterns = (
        rf"{variable_pattern}\s*<-\s*\(\s*([^\s()]+)",  # pattern of a rule
        rf"\(bind\s+{variable_pattern}\s+\(assert\s+\(\s*([^\s()]+)",
        rf"\(\s*{variable_pattern}\s+([^\s()?]+)\s*\)",  # member of a query
    )
    # Of the first pattern with a match, the last match is the binding that is nearest to the cursor.
    return next((str(matches[-1]) for pattern in patterns if (matches := re.findall(pattern, text))), "")
