"""A text that is cut says how long it is."""

from __future__ import annotations

from cxbridge.history.truncation import truncate


def test_a_long_text_says_how_long_it_is():
    assert truncate("x" * 10, 10) == "x" * 10
    assert truncate("x" * 11, 10) == "x" * 10 + " … (11 characters)"
