"""Formats CLIPS text: indents lines by their parentheses, and changes only white space.

White space within a line stays, so that aligned columns remain aligned. Text with unbalanced parentheses or
quotes stays unchanged, because the depth of its lines is unknown.
"""

from __future__ import annotations

from itertools import takewhile
from typing import Final

from cxbridge.clipstext.syntax import TOKEN
from cxbridge_studio.agent.top_level import is_balanced

_INDENT_STEP: Final = 2  # columns per level
_BLANKS: Final = frozenset(" \t\n\r\f\v")
_MAX_LINE_ENDS: Final = 3  # three line ends in a row are two empty lines

# The heads of lists whose content is indented by `_INDENT_STEP`. In other lists, the arguments are aligned
# with the first argument, except on lines that the author has indented by `_INDENT_STEP`.
_BLOCK_HEADS: Final = frozenset(
    {"defrule", "deffunction", "deftemplate", "deffacts", "defmethod", "defgeneric", "defclass"}
    | {"slot", "multislot", "field", "multifield", "definstances", "defmessage-handler", "defmodule"}
    | {"if", "while", "loop-for-count", "foreach", "progn", "progn$", "switch", "case", "default", "bind"}
    | {"do-for-fact", "do-for-all-facts", "delayed-do-for-all-facts", "find-fact", "find-all-facts"}
    | {"any-factp", "return"}
)

_IF_KEYWORDS: Final = frozenset({"then", "else"})


def indent_clips(text: str) -> str:
    """Return CLIPS text with its lines indented, or the same text if it is not balanced."""
    if not is_balanced(text):
        return text
    line_end = "\r\n" if "\r\n" in text else "\n"
    writer = _TokenWriter()
    for match in TOKEN.finditer(text.replace("\r\n", "\n")):
        writer.add_token(match.group(), is_trivia=match.lastgroup == "blank")
    return writer.text().replace("\n", line_end)


class _OpenList:
    """A list that is still open.

    :ivar column: the column of the opening parenthesis.
    :ivar source_column: the column of the opening parenthesis before formatting.
    :ivar head: the first word of the list; None before that word is read.
    :ivar argument_column: the column for further arguments; None before the first argument is read.
    """

    def __init__(self, column: int, source_column: int) -> None:
        self.column = column
        self.source_column = source_column
        self.head: str | None = None
        self.argument_column: int | None = None

    def token_column(self, token: str, source_column: int) -> int:
        """Return the column of a line that begins with this token inside the list.

        :param source_column: the column of the token before formatting.
        """
        if token == ")":
            return self.column
        # `then` and `else` stand between the `(if` and the indented branches.
        if token in _IF_KEYWORDS and self.head == "if":
            return self.column + 1
        # A list without a head word, such as ((?f template) (?g template)), aligns its elements.
        if self.head is None or self.head == "(":
            return self.column + 1
        is_hanging = source_column == self.source_column + _INDENT_STEP
        if self.head in _BLOCK_HEADS or self.argument_column is None or is_hanging:
            return self.column + _INDENT_STEP
        return self.argument_column


class _TokenWriter:
    """Writes tokens one after the other, and indents each line."""

    def __init__(self) -> None:
        self._tokens: list[str] = []
        self._open_lists: list[_OpenList] = []
        self._column = 0
        self._source_column = 0
        self._is_at_line_start = True

    def add_token(self, token: str, *, is_trivia: bool) -> None:
        """Write a token: code, a comment, or white space.

        :param is_trivia: whether the token is a comment or white space.
        """
        if not is_trivia:
            self._write_indentation(token)
            self._write_code(token)
        elif token.startswith(";"):
            self._write_indentation(token)
            self._write(token.rstrip("".join(_BLANKS)))
        elif not _BLANKS.issuperset(token):
            self._write(token)  # CLIPS takes Unicode blanks for text
        elif "\n" in token:
            if self._tokens:  # empty lines at the start of the file are dropped
                self._write("\n" * min(token.count("\n"), _MAX_LINE_ENDS))
            self._is_at_line_start = True
        elif not self._is_at_line_start:
            self._write(token.replace("\t", " "))
        self._source_column = _column_after(token, self._source_column)

    def text(self) -> str:
        """Return the written text, ending with one line end."""
        text = "".join(self._tokens).rstrip("".join(_BLANKS))
        return text + "\n" if text else ""

    def _write_indentation(self, token: str) -> None:
        """Write the indentation before a token that begins its line."""
        if self._is_at_line_start and self._open_lists:
            self._write(" " * self._open_lists[-1].token_column(token, self._source_column))
        self._is_at_line_start = False

    def _write_code(self, token: str) -> None:
        if token == ")":
            self._open_lists.pop()
        else:
            self._record_in_list(token)
            if token == "(":
                self._open_lists.append(_OpenList(self._column, self._source_column))
        self._write(token)

    def _record_in_list(self, token: str) -> None:
        """Record a token as the head or the first argument of the innermost list."""
        if not self._open_lists:
            return
        inner_list = self._open_lists[-1]
        if inner_list.head is None:
            inner_list.head = token
        elif inner_list.argument_column is None and inner_list.head != "(":
            # Only an argument in the line of the head sets the column for further arguments.
            tokens_after_head = takewhile(lambda earlier: earlier != inner_list.head, reversed(self._tokens))
            is_on_head_line = not any("\n" in earlier for earlier in tokens_after_head)
            inner_list.argument_column = self._column if is_on_head_line else inner_list.column + _INDENT_STEP

    def _write(self, text: str) -> None:
        self._tokens.append(text)
        self._column = _column_after(text, self._column)


def _column_after(text: str, column: int) -> int:
    """Return the column after a text that begins at a column."""
    _, line_end, last_line = text.rpartition("\n")
    return len(last_line) if line_end else column + len(text)
