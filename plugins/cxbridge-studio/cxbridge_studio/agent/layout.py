"""Formats CLIPS text: indents lines by their parentheses and changes nothing but white space.

White space within a line stays, so that aligned columns remain. Text with unbalanced parentheses or quotes
stays unchanged, since the depth of its lines is unknown.
"""

from __future__ import annotations

from itertools import takewhile
from typing import Final

from cxbridge.clipstext.syntax import PARENTHESIS, TOKEN, blank
from cxbridge_studio.agent.top_level import top_level_lists

_STEP: Final = 2  # columns per level
_BLANKS: Final = frozenset(" \t\n\r\f\v")
_MAX_LINE_ENDS: Final = 3  # three line ends in a row are two empty lines

# Lists with content that is indented by `_STEP`. In other lists, the arguments are aligned with the first
# argument.
_BLOCKS: Final = frozenset(
    {"defrule", "deffunction", "deftemplate", "deffacts", "defglobal", "defmethod", "defgeneric", "defclass"}
    | {"slot", "multislot", "field", "multifield", "definstances", "defmessage-handler", "defmodule"}
    | {"if", "while", "loop-for-count", "foreach", "progn", "progn$", "switch", "case", "default", "bind"}
    | {"do-for-fact", "do-for-all-facts", "delayed-do-for-all-facts", "find-fact", "find-all-facts"}
    | {"any-factp", "return"}
)

_WORDS_OF_IF: Final = frozenset({"then", "else"})


def is_balanced(text: str) -> bool:
    """Return whether a text closes all its parentheses and strings, and has no ``)`` too many."""
    if any(not top_list.closed for top_list in top_level_lists(text)):
        return False
    depth = 0
    for match in PARENTHESIS.finditer(blank(text)):
        depth += 1 if match[0] == "(" else -1
        if depth < 0:
            return False
    return depth == 0 and not any(match.lastgroup == "unclosed" for match in TOKEN.finditer(text))


def layout(text: str) -> str:
    """Return CLIPS text with its lines indented, or the same text if it is not balanced."""
    if not is_balanced(text):
        return text
    line_end = "\r\n" if "\r\n" in text else "\n"
    writer = _Writer()
    for match in TOKEN.finditer(text.replace("\r\n", "\n")):
        writer.add(match.group(), is_blank=match.lastgroup == "blank")
    return writer.text().replace("\n", line_end)


class _OpenList:
    """A list that is still open.

    :ivar column: the column of the opening parenthesis.
    :ivar head: the first word of the list; None before that word is read.
    :ivar argument_column: the column for further arguments; None before the first argument is read.
    """

    def __init__(self, column: int) -> None:
        self.column = column
        self.head: str | None = None
        self.argument_column: int | None = None

    def indent(self, token: str) -> int:
        """Return the column of a line that begins with this token inside the list."""
        if token == ")":
            return self.column
        # `then` and `else` stand between the `(if` and the indented branches.
        if token in _WORDS_OF_IF and self.head == "if":
            return self.column + 1
        # A list without a head word, such as ((?f template) (?g template)), aligns its elements.
        if self.head is None or self.head == "(":
            return self.column + 1
        if self.head in _BLOCKS or self.argument_column is None:
            return self.column + _STEP
        return self.argument_column


class _Writer:
    """Writer of indented tokens."""

    def __init__(self) -> None:
        self._tokens: list[str] = []
        self._open_lists: list[_OpenList] = []
        self._column = 0
        self._begins_line = True

    def add(self, token: str, *, is_blank: bool) -> None:
        """Write a token: code, a comment, or white space.

        :param is_blank: whether the token is a comment or white space.
        """
        if not is_blank:
            self._indent(token)
            self._code(token)
        elif token.startswith(";"):
            self._indent(token)
            self._write(token.rstrip("".join(_BLANKS)))
        elif not _BLANKS.issuperset(token):
            self._write(token)  # CLIPS treats Unicode blanks as text
        elif "\n" in token:
            if self._tokens:  # empty lines at the start of the file are dropped
                self._write("\n" * min(token.count("\n"), _MAX_LINE_ENDS))
            self._begins_line = True
        elif not self._begins_line:
            self._write(token.replace("\t", " "))

    def text(self) -> str:
        """Return the written text, ending with one line end."""
        written = "".join(self._tokens).rstrip("".join(_BLANKS))
        return written + "\n" if written else ""

    def _indent(self, token: str) -> None:
        """Write the indentation if a token begins its line."""
        if self._begins_line and self._open_lists:
            self._write(" " * self._open_lists[-1].indent(token))
        self._begins_line = False

    def _code(self, token: str) -> None:
        if token == ")":
            self._open_lists.pop()
        else:
            self._record(token)
            if token == "(":
                self._open_lists.append(_OpenList(self._column))
        self._write(token)

    def _record(self, token: str) -> None:
        """Record a token as the head or the first argument of the innermost list."""
        if not self._open_lists:
            return
        inner = self._open_lists[-1]
        if inner.head is None:
            inner.head = token
        elif inner.argument_column is None and inner.head != "(":
            # Only an argument in the line of the head sets the column for further arguments.
            since_head = takewhile(lambda written: written != inner.head, reversed(self._tokens))
            on_same_line = not any("\n" in written for written in since_head)
            inner.argument_column = self._column if on_same_line else inner.column + _STEP

    def _write(self, text: str) -> None:
        self._tokens.append(text)
        _, line_end, last_line = text.rpartition("\n")
        self._column = len(last_line) if line_end else self._column + len(text)
