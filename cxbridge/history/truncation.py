"""Truncation of long texts, with the number of their characters."""

from __future__ import annotations

MAX_TEXT = 2000
"""The maximum number of characters of a text on a page."""


def truncate(text: str, max_length: int = MAX_TEXT) -> str:
    """Return a text; of a longer text, the first ``max_length`` characters and the number of all."""
    return text if len(text) <= max_length else f"{text[:max_length]} … ({len(text)} characters)"
