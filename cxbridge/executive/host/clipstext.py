"""CLIPS text as CLIPS' scanner cuts it: what stands in strings and comments is no code."""

from __future__ import annotations

import re

TOKEN = re.compile(r'"(?:[^"\\]|\\.)*(?:"|\Z)|;[^\n]*|[()]', re.DOTALL)
"""A string, a comment or a parenthesis."""

_HIDDEN = re.compile(r'"(?:[^"\\]|\\.)*(?:"|\Z)|;[^\n]*', re.DOTALL)
_NOT_A_LINE_END = re.compile(r"[^\n]")


def blank(text: str) -> str:
    """Return the text with blanks in place of strings and comments: all that is left is code.

    Places and line ends stay where they are.
    """
    return _HIDDEN.sub(lambda match: _NOT_A_LINE_END.sub(" ", match.group()), text)
