"""Finds the unclosed list of a construct from its indentation and from the syntax of CLIPS.

A parser notices a missing parenthesis only at the end of the construct, but any list in the construct may be
the open list. This module tries each possible position of a ``)`` and takes the position with the least cost.
The cost counts oddities: lines that are indented no deeper than their list, slots within slots, an arrow
within a pattern, and similar mistakes.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from typing import Final

from msgspec import Struct

from cxbridge.clipstext.syntax import HIDDEN, TOKEN, Lines, read

_TAB_COLUMNS: Final = 2  # columns of a tab in Fawkes' files
# In a construct with more positions, only the positions at line ends are tried, which bounds the time.
_MAX_POSITIONS: Final = 1500
# The time grows with each missing parenthesis. If more are missing, a piece of text was probably deleted.
_MAX_MISSING: Final = 3

# Costs of oddities, from certain mistakes to mere style. `python -m studio_tests.check.deletions` measures
# how often the right list is named: in 99 of 100 cases with these costs.
_BROKEN_COST: Final = 10.0
_HARD_COST: Final = 3.0
_STRUCTURE_COST: Final = 2.0
_SOFT_COST: Final = 1.0

_CHANGE_FUNCTIONS: Final = frozenset({"modify", "duplicate"})
_COMPARISON_FUNCTIONS: Final = frozenset({"eq", "neq", "=", "<>", "<", ">", "<=", ">=", "and", "or"})
_MIN_COMPARED_VALUES: Final = 2  # the arguments of a comparison
# Functions that are rarely called directly within a call of the same function.
_RARELY_NESTED: Final = _COMPARISON_FUNCTIONS | {"create$"}
# Functions of CLIPS with a fixed number of arguments.
_ARGUMENT_COUNTS: Final = {
    **dict.fromkeys(("length$", "first$", "rest$", "fact-existp", "fact-relation", "str-length", "abs"), 1),
    **dict.fromkeys(("nth$", "member$", "subsetp", "fact-slot-value", "str-index", "mod"), 2),
    **dict.fromkeys(("subseq$", "sub-string"), 3),
}
_FACETS: Final = frozenset({"type", "default", "default-dynamic", "range", "cardinality", "allowed-values"})
# Words that belong directly into a list with this head.
_KEYWORDS: Final = {"then": "if", "else": "if"}
_SLOT_KEYWORDS: Final = frozenset({"slot", "multislot", "field", "multifield"})
# Conditional elements that may contain `?fact <- (pattern)`.
_CONDITION_HEADS: Final = frozenset({"and", "or", "not", "exists", "forall", "logical"})

_BEGINNING: Final = re.compile(r"\((def\w+)\s+([^\s()\";]+)")


class _Token(Struct, frozen=True):
    """A token of a construct.

    :param column: the column of the token, with tabs expanded.
    :param indent: the column of the first token in its line.
    :param is_first: whether the token is the first in its line.
    """

    text: str
    start: int
    end: int
    column: int
    indent: int
    is_first: bool


class _OpenList(Struct, frozen=True):
    """An open list.

    :param token: the opening parenthesis.
    :param child_count: the number of elements that were read after the head.
    """

    token: _Token
    head: str = ""
    child_count: int = 0


def find_unclosed_lists(text: str, slots: Mapping[str, Collection[str]] | None = None) -> list[int]:
    """Return the offsets of the unclosed lists of a construct, in the order of the text.

    :param text: the text of the construct, up to the start of the next construct.
    :param slots: the slot names of the known deftemplates, by deftemplate.
    """
    tokens = list(_tokenize(text))
    missing_count = sum((token.text == "(") - (token.text == ")") for token in tokens)
    names = _SlotNames(slots or {})
    starts: list[int] = []
    for _ in range(min(missing_count, _MAX_MISSING)):
        index, opening = _find_best_position(tokens, names)
        starts.append(opening.start)
        last = tokens[index - 1]
        tokens.insert(index, _Token(")", last.end, last.end, last.column, last.indent, is_first=False))
    return sorted(starts)


def _find_best_position(tokens: list[_Token], names: _SlotNames) -> tuple[int, _Token]:
    """Return the token index where a ``)`` is missing, and the ``(`` that it closes.

    Of positions with equal costs, the last counts: a ``)`` there closes the outermost list.
    """
    candidates, states = set(_find_candidates(tokens)), list[tuple[int, _Reading]]()
    reading = _Reading(tokens, names)
    # All candidates share the reading of the text before them: each continues from a copy of the state.
    for index in range(len(tokens)):
        if index in candidates and reading.stack:
            states.append((index, reading.copy()))
        reading.read_token(index)
    states.append((len(tokens), reading))
    best, lowest_cost = (len(tokens), tokens[0]), float("inf")
    for index, state in reversed(states):
        opening = state.stack[-1].token if state.stack else tokens[0]
        cost = state.compute_cost_with(index, lowest_cost)
        if cost < lowest_cost:
            best, lowest_cost = (index, opening), cost
    return best


def _tokenize(text: str) -> Iterator[_Token]:
    """Yield the tokens of a text, without white space and comments."""
    line_start = indent = 0
    is_first = True
    for match in TOKEN.finditer(text):
        token = match.group()
        if match.lastgroup == "blank":
            if "\n" in token:
                line_start, is_first = match.start() + token.rindex("\n") + 1, True
            continue
        column = len(text[line_start : match.start()].expandtabs(_TAB_COLUMNS))
        if is_first:
            indent = column
        yield _Token(token, match.start(), match.end(), column, indent, is_first)
        is_first = False


def _find_candidates(tokens: list[_Token]) -> list[int]:
    """Return the token indices where a ``)`` may be missing.

    Positions before a ``)`` are omitted: a ``)`` after the existing one has the same effect.
    """
    ends = range(2, len(tokens) + 1)
    indices = [index for index in ends if index == len(tokens) or tokens[index].text != ")"]
    if len(indices) > _MAX_POSITIONS:
        indices = [index for index in indices if index == len(tokens) or tokens[index].is_first]
    return indices


class _SlotNames:
    """The slot names of the known deftemplates."""

    def __init__(self, slots: Mapping[str, Collection[str]]) -> None:
        self.slots = slots
        self.all_slots = frozenset(name for names in slots.values() for name in names)

    def compute_opening_cost(self, stack: list[_OpenList], head: str) -> float:
        """Return the cost of opening a list with this head within the open lists."""
        parent = stack[-1].head
        grandparent = stack[-2].head if len(stack) > 1 else ""
        slots = self.slots.get(parent, ())
        oddities = (
            # a pattern or fact with an unknown slot
            (slots and head not in slots),
            # a slot within a slot of a fact
            (
                parent in self.all_slots
                and head in self.all_slots
                and (grandparent in self.slots or grandparent in _CHANGE_FUNCTIONS)
            ),
            # a definition of a slot within another
            (parent in _SLOT_KEYWORDS and head in _SLOT_KEYWORDS),
            # a facet within a facet
            (parent in _FACETS and head in _FACETS and grandparent in _SLOT_KEYWORDS),
            # a deftemplate with anything but slots
            (parent == "deftemplate" and head not in _SLOT_KEYWORDS),
        )
        return _STRUCTURE_COST * sum(map(bool, oddities)) + _SOFT_COST * (
            parent == head and head in _RARELY_NESTED
        )


class _Reading:
    """The state of reading a construct: the open lists, and the cost of the oddities so far."""

    def __init__(self, tokens: list[_Token], names: _SlotNames) -> None:
        self.stack: list[_OpenList] = []
        self.cost = 0.0
        self._tokens = tokens
        self._names = names

    def copy(self) -> _Reading:
        other = _Reading(self._tokens, self._names)
        other.stack, other.cost = [*self.stack], self.cost
        return other

    def compute_cost_with(self, insertion_index: int, limit: float) -> float:
        """Return the cost of the whole construct with a ``)`` inserted before a token.

        :param insertion_index: the index of that token, which is the next to read.
        :param limit: the cost at which reading ends early, because another position costs less.
        """
        if self.cost < limit:
            self._close_list()
            for index in range(insertion_index, len(self._tokens)):
                self.read_token(index)
                if self.cost >= limit:
                    break
        return self.cost + _BROKEN_COST * len(self.stack)

    def read_token(self, index: int) -> None:
        """Read a token and add the cost of its oddities."""
        token = self._tokens[index]
        if token.text == ")":
            self._close_list()
            return
        if not self.stack and index:  # text after the end of the construct
            self.cost += _BROKEN_COST
        if token.is_first:
            self.cost += _compute_indentation_cost(token, self.stack)
        if token.text == "(":
            self._open_list(token, index)
        elif self.stack:
            self._read_word(token, is_head=self._tokens[index - 1].text == "(")

    def _open_list(self, token: _Token, index: int) -> None:
        head = self._tokens[index + 1].text if index + 1 < len(self._tokens) else ""
        if self.stack:
            self.cost += self._names.compute_opening_cost(self.stack, head)
            self._count_element()
        self.stack.append(_OpenList(token))

    def _read_word(self, token: _Token, *, is_head: bool) -> None:
        inner_list = self.stack[-1]
        if is_head:
            self.stack[-1] = _OpenList(inner_list.token, token.text)
            return
        self._count_element()
        if token.text == "=>":  # belongs directly into the rule
            self.cost += _BROKEN_COST * (len(self.stack) - 1)
        elif token.text in _KEYWORDS:
            self.cost += _HARD_COST * (inner_list.head != _KEYWORDS[token.text])
        elif token.text == "<-":
            self.cost += _HARD_COST * (len(self.stack) > 1 and inner_list.head not in _CONDITION_HEADS)

    def _count_element(self) -> None:
        inner_list = self.stack[-1]
        self.stack[-1] = _OpenList(inner_list.token, inner_list.head, inner_list.child_count + 1)

    def _close_list(self) -> None:
        if not self.stack:
            return
        closed_list = self.stack.pop()
        is_comparison = closed_list.head in _COMPARISON_FUNCTIONS
        if closed_list.child_count != _ARGUMENT_COUNTS.get(closed_list.head, closed_list.child_count) or (
            is_comparison and closed_list.child_count < _MIN_COMPARED_VALUES
        ):
            self.cost += _SOFT_COST


def _compute_indentation_cost(token: _Token, stack: list[_OpenList]) -> float:
    """Return the cost of a line that is indented no deeper than its open lists.

    The construct itself does not count: its content may begin at the start of a line.
    """
    cost = 0.0
    for open_list in stack[1:]:
        if token.column <= open_list.token.indent:
            cost += _HARD_COST
        elif token.column <= open_list.token.column:
            cost += _SOFT_COST
    return cost


class UnclosedConstruct(Struct, frozen=True):
    """An unclosed construct.

    :param start: the offset of the unclosed list, or of the construct if a string is unclosed.
    """

    start: int
    message: str
    hint: str


def describe_unclosed(
    construct: str, start: int, lines: Lines, text: str, slots: Mapping[str, Collection[str]]
) -> UnclosedConstruct:
    """Describe the mistake in an unclosed construct.

    :param construct: the text of the construct, up to the start of the next construct.
    :param start: the offset of the construct in the file.
    :param lines: the lines of the file.
    :param text: the text of the whole file.
    :param slots: the slot names of the known deftemplates, by deftemplate.
    """
    line = lines.at(start)
    beginning = _BEGINNING.match(construct)
    message = f"{' '.join(beginning.groups()) if beginning else 'this'} never closes"
    rows = enumerate(text.splitlines()[line:], line + 1)
    next_line = next((number for number, row in rows if row.lstrip().startswith("(def")), 0)
    end = f"line {next_line}" if next_line else "the end of the file"
    quote = _find_open_quote(text[start : lines.place(next_line) if next_line else len(text)])
    if quote is not None:
        hint = f'a " is missing in line {lines.at(start + quote)} or before {end}'
        return UnclosedConstruct(start + quote, f"{message}: its string is open", hint)
    hint = f"a ) is missing before {end}"
    if list_offset := next(iter(find_unclosed_lists(construct, slots)), 0):  # 0 is the construct itself
        start += list_offset
        head = read(construct[list_offset:], close=True)[0].head
        message += f": its list ({head} is open" if head else ": a list in it is open"
        hint += f"; {beginning[1] if beginning else 'the construct'} begins in line {line}"
    return UnclosedConstruct(start, message, hint)


def _find_open_quote(construct: str) -> int | None:
    """Return the offset of the string that probably lacks its closing quote; None if all strings close."""
    strings = [match for match in HIDDEN.finditer(construct) if match[0].startswith('"')]
    if not any(match["unclosed"] for match in strings):
        return None
    # After a missing quote, each closing quote opens a string, and a word follows it directly.
    shifted = (
        match
        for match in strings
        if "\n" in match[0] and construct[match.end() : match.end() + 1].strip(" \t\n)")
    )
    return next(shifted, strings[-1]).start()
