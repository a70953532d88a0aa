"""Truncation of long texts, with the number of their characters."""

from __future__ import annotations

# Chosen freely: longer than usual skill strings and errors.
MAX_TEXT_CHARACTERS = 2000
"""The maximum number of characters of a text in a history, unless another limit is given."""


def truncate(text: str, max_length: int = MAX_TEXT_CHARACTERS) -> str:
    """Return the first ``max_length`` characters of a text, followed by its length if the text is longer."""
    return text if len(text) <= max_length else f"{text[:max_length]} … ({len(text)} characters)"
