"""Finds the unclosed list of a construct from its indentation and from the syntax of CLIPS.

A parser notices a missing parenthesis only at the end of the construct, but any list may lack the
parenthesis. This module tries each possible position of a ``)`` and takes the position where the construct
costs least. Oddities have costs: lines that are indented no deeper than their list, slots within slots, an
arrow within a pattern, and similar mistakes.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from typing import Final

from msgspec import Struct

from cxbridge.clipstext.syntax import HIDDEN, TOKEN, Lines, read

_TAB: Final = 2  # columns of a tab in Fawkes' files
# With more positions than this, only those at line ends are tried, to bound the time.
_MAX_POSITIONS: Final = 1500
# The time grows with each missing parenthesis, and more than three are a deleted piece of text.
_MAX_MISSING: Final = 3

# Costs of oddities, from certain mistakes to mere style. `python -m studio_tests.check.deletions` measures
# how often the right list is named: in 99 of 100 cases with these costs.
_BROKEN: Final = 10.0
_HARD: Final = 3.0
_STRUCTURE: Final = 2.0
_SOFT: Final = 1.0

_CHANGES: Final = frozenset({"modify", "duplicate"})
_COMPARISONS: Final = frozenset({"eq", "neq", "=", "<>", "<", ">", "<=", ">=", "and", "or"})
_MIN_COMPARED: Final = 2
# Functions that are rarely called directly within a call of the same function.
_RARELY_NESTED: Final = _COMPARISONS | {"create$"}
# Functions of CLIPS with a fixed number of arguments.
_ARGUMENT_COUNTS: Final = {
    **dict.fromkeys(("length$", "first$", "rest$", "fact-existp", "fact-relation", "str-length", "abs"), 1),
    **dict.fromkeys(("nth$", "member$", "subsetp", "fact-slot-value", "str-index", "mod"), 2),
    **dict.fromkeys(("subseq$", "sub-string"), 3),
}
_FACETS: Final = frozenset({"type", "default", "default-dynamic", "range", "cardinality", "allowed-values"})
# Words that belong directly into one kind of list.
_KEYWORDS: Final = {"then": "if", "else": "if"}
_SLOTS: Final = frozenset({"slot", "multislot", "field", "multifield"})
# Conditional elements that may contain `?fact <- (pattern)`.
_CONDITIONS: Final = frozenset({"and", "or", "not", "exists", "forall", "logical"})

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


class _List(Struct, frozen=True):
    """An open list.

    :param token: the opening parenthesis.
    :param children: the number of elements that were read after the head.
    """

    token: _Token
    head: str = ""
    children: int = 0


def unclosed_lists(text: str, slots: Mapping[str, Collection[str]] | None = None) -> list[int]:
    """Return the offsets of the unclosed lists of a construct, in the order of the text.

    :param text: the text of the construct, up to the start of the next construct.
    :param slots: the slot names of the known deftemplates, by deftemplate.
    """
    tokens = list(_tokens(text))
    missing = sum((token.text == "(") - (token.text == ")") for token in tokens)
    names = _Names(slots or {})
    starts: list[int] = []
    for _ in range(min(missing, _MAX_MISSING)):
        index, opening = _best_position(tokens, names)
        starts.append(opening.start)
        last = tokens[index - 1]
        tokens.insert(index, _Token(")", last.end, last.end, last.column, last.indent, is_first=False))
    return sorted(starts)


def _best_position(tokens: list[_Token], names: _Names) -> tuple[int, _Token]:
    """Return the token index where a ``)`` is missing, and the ``(`` that it closes.

    Of positions with equal costs, the last is returned: a ``)`` there closes the outermost list.
    """
    candidates, states = set(_candidates(tokens)), list[tuple[int, _Reading]]()
    reading = _Reading(tokens, names)
    # All candidates share the reading of the text before them: each continues from a copy of the state.
    for index in range(len(tokens)):
        if index in candidates and reading.stack:
            states.append((index, reading.copy()))
        reading.step(index)
    states.append((len(tokens), reading))
    best, lowest_cost = (len(tokens), tokens[0]), float("inf")
    for index, state in reversed(states):
        opening = state.stack[-1].token if state.stack else tokens[0]
        cost = state.cost_with(index, lowest_cost)
        if cost < lowest_cost:
            best, lowest_cost = (index, opening), cost
    return best


def _tokens(text: str) -> Iterator[_Token]:
    """Yield the tokens of a text, without white space and comments."""
    line_start = indent = 0
    is_first = True
    for match in TOKEN.finditer(text):
        token = match.group()
        if match.lastgroup == "blank":
            if "\n" in token:
                line_start, is_first = match.start() + token.rindex("\n") + 1, True
            continue
        column = len(text[line_start : match.start()].expandtabs(_TAB))
        if is_first:
            indent = column
        yield _Token(token, match.start(), match.end(), column, indent, is_first)
        is_first = False


def _candidates(tokens: list[_Token]) -> list[int]:
    """Return the token indices where a ``)`` may be missing.

    Positions before a ``)`` are left out: a ``)`` after the existing one has the same effect.
    """
    ends = range(2, len(tokens) + 1)
    indices = [index for index in ends if index == len(tokens) or tokens[index].text != ")"]
    if len(indices) > _MAX_POSITIONS:
        indices = [index for index in indices if index == len(tokens) or tokens[index].is_first]
    return indices


class _Names:
    """Slot names of the known deftemplates."""

    def __init__(self, slots: Mapping[str, Collection[str]]) -> None:
        self.slots = slots
        self.all = frozenset(name for names in slots.values() for name in names)

    def opening_cost(self, stack: list[_List], head: str) -> float:
        """Return the cost of a list with a head word within the open lists."""
        parent = stack[-1].head
        grandparent = stack[-2].head if len(stack) > 1 else ""
        slots = self.slots.get(parent, ())
        oddities = (
            # a pattern or fact with an unknown slot
            (slots and head not in slots),
            # a slot within a slot of a fact
            (
                parent in self.all
                and head in self.all
                and (grandparent in self.slots or grandparent in _CHANGES)
            ),
            # a definition of a slot within another
            (parent in _SLOTS and head in _SLOTS),
            # a facet within a facet
            (parent in _FACETS and head in _FACETS and grandparent in _SLOTS),
            # a deftemplate with anything but slots
            (parent == "deftemplate" and head not in _SLOTS),
        )
        return _STRUCTURE * sum(map(bool, oddities)) + _SOFT * (parent == head and head in _RARELY_NESTED)


class _Reading:
    """The state of reading a construct: the open lists, and the cost of the oddities so far."""

    def __init__(self, tokens: list[_Token], names: _Names) -> None:
        self.stack: list[_List] = []
        self.cost = 0.0
        self._tokens = tokens
        self._names = names

    def copy(self) -> _Reading:
        other = _Reading(self._tokens, self._names)
        other.stack, other.cost = [*self.stack], self.cost
        return other

    def cost_with(self, insertion: int, limit: float) -> float:
        """Return the cost of the whole construct with a ``)`` inserted before a token.

        :param insertion: the index of that token, which is the next to read.
        :param limit: the cost at which reading ends early, because another position costs less.
        """
        if self.cost < limit:
            self._close()
            for index in range(insertion, len(self._tokens)):
                self.step(index)
                if self.cost >= limit:
                    break
        return self.cost + _BROKEN * len(self.stack)

    def step(self, index: int) -> None:
        token = self._tokens[index]
        if token.text == ")":
            self._close()
            return
        if not self.stack and index:  # text after the end of the construct
            self.cost += _BROKEN
        if token.is_first:
            self.cost += _indentation_cost(token, self.stack)
        if token.text == "(":
            self._open(token, index)
        elif self.stack:
            self._word(token, is_head=self._tokens[index - 1].text == "(")

    def _open(self, token: _Token, index: int) -> None:
        head = self._tokens[index + 1].text if index + 1 < len(self._tokens) else ""
        if self.stack:
            self.cost += self._names.opening_cost(self.stack, head)
            self._count_element()
        self.stack.append(_List(token))

    def _word(self, token: _Token, *, is_head: bool) -> None:
        inner = self.stack[-1]
        if is_head:
            self.stack[-1] = _List(inner.token, token.text)
            return
        self._count_element()
        if token.text == "=>":  # belongs directly into the rule
            self.cost += _BROKEN * (len(self.stack) - 1)
        elif token.text in _KEYWORDS:
            self.cost += _HARD * (inner.head != _KEYWORDS[token.text])
        elif token.text == "<-":
            self.cost += _HARD * (len(self.stack) > 1 and inner.head not in _CONDITIONS)

    def _count_element(self) -> None:
        inner = self.stack[-1]
        self.stack[-1] = _List(inner.token, inner.head, inner.children + 1)

    def _close(self) -> None:
        if not self.stack:
            return
        closed = self.stack.pop()
        is_comparison = closed.head in _COMPARISONS
        if closed.children != _ARGUMENT_COUNTS.get(closed.head, closed.children) or (
            is_comparison and closed.children < _MIN_COMPARED
        ):
            self.cost += _SOFT


def _indentation_cost(token: _Token, stack: list[_List]) -> float:
    """Return the cost of a line that is indented no deeper than its open lists.

    The construct itself is left out: its content may begin at the start of a line.
    """
    cost = 0.0
    for open_list in stack[1:]:
        if token.column <= open_list.token.indent:
            cost += _HARD
        elif token.column <= open_list.token.column:
            cost += _SOFT
    return cost


class Unclosed(Struct, frozen=True):
    """An unclosed construct.

    :param start: the offset of the unclosed list, or of the construct if a string is unclosed.
    """

    start: int
    message: str
    hint: str


def describe_unclosed(
    construct: str, start: int, lines: Lines, text: str, slots: Mapping[str, Collection[str]]
) -> Unclosed:
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
    if any(match["unclosed"] for match in HIDDEN.finditer(construct)):
        return Unclosed(start, message, "a string in it never closes")
    rows = enumerate(text.splitlines()[line:], line + 1)
    next_line = next((number for number, row in rows if row.lstrip().startswith("(def")), 0)
    hint = f"a ) is missing before {f'line {next_line}' if next_line else 'the end of the file'}"
    if inner := next(iter(unclosed_lists(construct, slots)), 0):  # 0 is the construct itself
        start += inner
        head = read(construct[inner:], close=True)[0].head
        message += f": its list ({head} is open" if head else ": a list in it is open"
        hint += f"; {beginning[1] if beginning else 'the construct'} begins in line {line}"
    return Unclosed(start, message, hint)
