"""Numbers in texts of users, clients and files."""

from __future__ import annotations

from typing import Final

MAX_DIGITS: Final = 18
"""The maximum length of a number; any number with so few digits fits into 64 bits."""


def parse_decimal(text: str, max_digits: int = MAX_DIGITS) -> int | None:
    """Return the number that a text of 1 to ``max_digits`` decimal digits means; None for any other text.

    A text with a sign is another text, too.
    """
    # isdecimal() alone accepts digits of other scripts, and int() refuses thousands of digits
    is_number = text.isascii() and text.isdecimal() and len(text) <= max_digits
    return int(text) if is_number else None
