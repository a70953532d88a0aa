"""Truncated texts have their length."""

from __future__ import annotations

from cxbridge.history.truncation import truncate


def test_truncated_text_has_length():
    assert truncate("x" * 10, 10) == "x" * 10
    assert truncate("x" * 11, 10) == "x" * 10 + " … (11 characters)"
