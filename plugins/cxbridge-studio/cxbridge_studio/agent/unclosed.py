"""Finds the unclosed list of a construct from its indentation and from the syntax of CLIPS.

A parser notices the missing parenthesis only at the end of the construct, but it may belong to any list. This
module tries each possible position of a ``)`` and takes the text with the lowest cost. Costs are added for
lines that are indented no deeper than their list, slots within slots, an arrow within a pattern, and similar
oddities.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from typing import Final

from msgspec import Struct

from cxbridge.clipstext.syntax import HIDDEN, TOKEN, Lines, read

_TAB: Final = 2  # Fawkes' files count a tab as two columns
# In longer constructs, only positions at line ends are tried, to bound the time.
_MAX_TRIED: Final = 1500
_MAX_MISSING: Final = 3

# Costs of oddities, from certain mistakes to mere style. `python -m studio_tests.check.deletions` tells how
# often the right list is named: with these costs and rules in 99 of 100 cases.
_BROKEN: Final = 10.0
_HARD: Final = 3.0
_STRUCTURE: Final = 2.0
_SOFT: Final = 1.0

_CHANGES: Final = frozenset({"modify", "duplicate"})
_COMPARE: Final = frozenset({"eq", "neq", "=", "<>", "<", ">", "<=", ">=", "and", "or"})
_COMPARED: Final = 2
_NEVER_NESTED: Final = _COMPARE | {"create$"}
# Functions of CLIPS with a fixed number of arguments.
_ARGUMENTS: Final = {
    **dict.fromkeys(("length$", "first$", "rest$", "fact-existp", "fact-relation", "str-length", "abs"), 1),
    **dict.fromkeys(("nth$", "member$", "subsetp", "fact-slot-value", "str-index", "mod"), 2),
    **dict.fromkeys(("subseq$", "sub-string"), 3),
}
_FACETS: Final = frozenset({"type", "default", "default-dynamic", "range", "cardinality", "allowed-values"})
_KEYWORDS: Final = {"then": "if", "else": "if"}
_SLOT: Final = frozenset({"slot", "multislot", "field", "multifield"})
_PATTERNS: Final = frozenset({"and", "or", "not", "exists", "forall", "logical"})

_BEGINNING: Final = re.compile(r"\((def\w+)\s+([^\s()\";]+)")


class _Token(Struct, frozen=True):
    """A token of a construct.

    :param column: counted with tabs expanded.
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

    :param children: the number of elements so far, without the head.
    """

    token: _Token
    head: str = ""
    children: int = 0


def unclosed_lists(text: str, slots: Mapping[str, Collection[str]] | None = None) -> list[int]:
    """Return the offsets of the unclosed lists of a construct, in the order of the text.

    :param text: the construct, up to the start of the next.
    :param slots: slot names by deftemplate.
    """
    tokens = list(_tokens(text))
    missing = sum((token.text == "(") - (token.text == ")") for token in tokens)
    names = _Names(slots or {})
    starts: list[int] = []
    for _ in range(min(missing, _MAX_MISSING)):
        index, opened = _best(tokens, names)
        starts.append(opened.start)
        last = tokens[index - 1]
        tokens.insert(index, _Token(")", last.end, last.end, last.column, last.indent, is_first=False))
    return sorted(starts)


def _best(tokens: list[_Token], names: _Names) -> tuple[int, _Token]:
    """Return the token index where a ``)`` is missing, and the list that it closes.

    Of equal positions, the last is returned: it closes the outermost list.
    """
    candidates, states = set(_candidates(tokens)), list[tuple[int, _Reading]]()
    reading = _Reading(tokens, names)
    # The text before a candidate is read once for all candidates: each continues from a copy of the state.
    for index in range(len(tokens)):
        if index in candidates and reading.stack:
            states.append((index, reading.copy()))
        reading.step(index)
    states.append((len(tokens), reading))
    best, lowest_cost = (len(tokens), tokens[0]), float("inf")
    for index, state in reversed(states):
        opened = state.stack[-1].token if state.stack else tokens[0]
        cost = state.cost_with(index, lowest_cost)
        if cost < lowest_cost:
            best, lowest_cost = (index, opened), cost
    return best


def _tokens(text: str) -> Iterator[_Token]:
    begin = indent = 0
    is_first = True
    for match in TOKEN.finditer(text):
        token = match.group()
        if match.lastgroup == "blank":
            if "\n" in token:
                begin, is_first = match.start() + token.rindex("\n") + 1, True
            continue
        column = len(text[begin : match.start()].expandtabs(_TAB))
        if is_first:
            indent = column
        yield _Token(token, match.start(), match.end(), column, indent, is_first)
        is_first = False


def _candidates(tokens: list[_Token]) -> list[int]:
    """Return the token indices where a ``)`` may be missing: never between two closing parentheses."""
    ends = range(2, len(tokens) + 1)
    indices = [index for index in ends if index == len(tokens) or tokens[index].text != ")"]
    if len(indices) > _MAX_TRIED:
        indices = [index for index in indices if index == len(tokens) or tokens[index].is_first]
    return indices


class _Names:
    """Slot names of the known deftemplates."""

    def __init__(self, slots: Mapping[str, Collection[str]]) -> None:
        self.slots = slots
        self.all = frozenset(name for names in slots.values() for name in names)

    def opening(self, stack: list[_List], head: str) -> float:
        parent = stack[-1].head
        above = stack[-2].head if len(stack) > 1 else ""
        slots = self.slots.get(parent, ())
        is_odd = (
            (slots and head not in slots),
            (parent in self.all and head in self.all and (above in self.slots or above in _CHANGES)),
            (parent in _SLOT and head in _SLOT),
            (parent in _FACETS and head in _FACETS and above in _SLOT),
            (parent == "deftemplate" and head not in _SLOT),
        )
        return _STRUCTURE * sum(map(bool, is_odd)) + _SOFT * (parent == head and head in _NEVER_NESTED)


class _Reading:
    """Parser state of a construct, with the cost of its oddities so far."""

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
        """Return the cost of the whole construct with a ``)`` inserted before this token.

        :param limit: stop at this cost.
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
        if not self.stack and index:
            self.cost += _BROKEN
        if token.is_first:
            self.cost += _layout(token, self.stack)
        if token.text == "(":
            self._open(token, index)
        elif self.stack:
            self._word(token, is_head=self._tokens[index - 1].text == "(")

    def _open(self, token: _Token, index: int) -> None:
        head = self._tokens[index + 1].text if index + 1 < len(self._tokens) else ""
        if self.stack:
            self.cost += self._names.opening(self.stack, head)
            self._count()
        self.stack.append(_List(token))

    def _word(self, token: _Token, *, is_head: bool) -> None:
        inner = self.stack[-1]
        if is_head:
            self.stack[-1] = _List(inner.token, token.text)
            return
        self._count()
        if token.text == "=>":
            self.cost += _BROKEN * (len(self.stack) - 1)
        elif token.text in _KEYWORDS:
            self.cost += _HARD * (inner.head != _KEYWORDS[token.text])
        elif token.text == "<-":
            self.cost += _HARD * (len(self.stack) > 1 and inner.head not in _PATTERNS)

    def _count(self) -> None:
        inner = self.stack[-1]
        self.stack[-1] = _List(inner.token, inner.head, inner.children + 1)

    def _close(self) -> None:
        if not self.stack:
            return
        closed = self.stack.pop()
        is_comparison = closed.head in _COMPARE
        if closed.children != _ARGUMENTS.get(closed.head, closed.children) or (
            is_comparison and closed.children < _COMPARED
        ):
            self.cost += _SOFT


def _layout(token: _Token, stack: list[_List]) -> float:
    """Return the cost of a line that is not indented deeper than its open lists."""
    cost = 0.0
    for open_list in stack[1:]:
        if token.column <= open_list.token.indent:
            cost += _HARD
        elif token.column <= open_list.token.column:
            cost += _SOFT
    return cost


class Unclosed(Struct, frozen=True):
    """An unclosed construct.

    :param start: offset of the unclosed list, or of the construct if a string is unclosed.
    """

    start: int
    message: str
    hint: str


def describe_unclosed(
    construct: str, start: int, lines: Lines, text: str, slots: Mapping[str, Collection[str]]
) -> Unclosed:
    """Describe the mistake in an unclosed construct.

    :param construct: its text, up to the start of the next construct.
    :param start: offset of the construct in the file.
    :param text: the whole file.
    :param slots: slot names by deftemplate.
    """
    line = lines.at(start)
    beginning = _BEGINNING.match(construct)
    message = f"{' '.join(beginning.groups()) if beginning else 'this'} never closes"
    if any(match["unclosed"] for match in HIDDEN.finditer(construct)):
        return Unclosed(start, message, "a string in it never closes")
    rows = enumerate(text.splitlines()[line:], line + 1)
    next_line = next((number for number, row in rows if row.lstrip().startswith("(def")), 0)
    hint = f"a ) is missing before {f'line {next_line}' if next_line else 'the end of the file'}"
    if inner := next(iter(unclosed_lists(construct, slots)), 0):
        start += inner
        head = read(construct[inner:], close=True)[0].head
        message += f": its list ({head} is open" if head else ": a list in it is open"
        hint += f"; {beginning[1] if beginning else 'the construct'} begins in line {line}"
    return Unclosed(start, message, hint)
