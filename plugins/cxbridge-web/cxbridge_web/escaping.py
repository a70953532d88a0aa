r"""Escaping of recorded text for a page: the text can neither end an element nor reverse the reading order.

Recorded text comes from programs, some of them untrusted. Three things are dangerous: markup, characters that
end a script (``</script>``) or, in old engines, a string in a script (U+2028), and invisible characters that
change the visible text (bidirectional controls). Invisible characters are shown by their number: ``\u202e``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from html import escape
from typing import Any

from cxbridge.printing import UNSAFE_CODE_POINTS, escape_code_point

# The codes of the characters to escape: unsafe and invisible characters.
_HIDDEN_CODES = (
    *UNSAFE_CODE_POINTS,
    0xAD,  # soft hyphen
    0x61C,  # Arabic letter mark
    *range(0x200B, 0x2010),  # zero-width characters and direction marks
    *range(0x2060, 0x2070),  # word joiner, invisible operators, direction isolates
    0xFEFF,  # byte order mark
    *range(0xFFF9, 0xFFFC),  # interlinear annotations
    *range(0xE0000, 0xE0080),  # tags
)

_INVISIBLE_ESCAPES: Mapping[int, str] = {
    code: escape_code_point(code) if code < 0x10000 else f"\\U{code:08x}"  # noqa: PLR2004 - the BMP ends there
    for code in _HIDDEN_CODES
}
_JSON_ESCAPES: Mapping[int, str] = {
    # A second backslash precedes the number, so that the script gets the number as text, not the character.
    # The encoder has already escaped characters below 0x20.
    **{code: "\\" + text for code, text in _INVISIBLE_ESCAPES.items() if code >= 0x20},  # noqa: PLR2004
    **{ord(character): f"\\u{ord(character):04x}" for character in "<>&"},
}


def escape_invisible(text: str) -> str:
    """Return a text with numbers in place of unsafe and invisible characters."""
    return text.translate(_INVISIBLE_ESCAPES)


def escape_html(text: object) -> str:
    """Escape a text for use between tags and within a quoted attribute."""
    return escape(escape_invisible(str(text)), quote=True)


def encode_for_script(value: Any) -> str:
    """Return a value as JSON text for a ``<script>`` element.

    :raises ValueError: for NaN and infinities.
    """
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.translate(_JSON_ESCAPES)
