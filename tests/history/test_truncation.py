"""A text that is cut says how long it is."""

from __future__ import annotations

from cxbridge.history.truncation import cut


def test_a_long_text_says_how_long_it_is():
    assert cut("x" * 10, 10) == "x" * 10
    assert cut("x" * 11, 10) == "x" * 10 + " … (11 characters)"
