"""Replacements equal those of std::regex_replace (of libstdc++ 12)."""

from __future__ import annotations

import pytest

from cxbridge.skiller.replacing import PatternError, replace_all


@pytest.mark.parametrize(
    ("pattern", "replacement", "value", "expected"),
    [
        ("a", "b", "banana", "bbnbnb"),
        ("A", "b", "banana", "bbnbnb"),
        ("(.)(.)", "$2$1", "abcd", "badc"),
        ("b", "[$&]", "abc", "a[b]c"),
        ("b", "$$", "abc", "a$c"),
        ("b", "$0", "abc", "abc"),
        ("(b)", "$01", "abc", "abc"),
        ("(b)", "$10", "abc", "ac"),
        ("b", "$", "abc", "a$c"),
        ("b", "$x", "abc", "a$xc"),
        ("x*", "-", "abxd", "-a-b--d-"),
        ("^a", "X", "aa", "Xa"),
        ("b$", "X", "ab", "aX"),
        (r"\x41", "X", "ABC", "XBC"),
        (r"\u0042", "X", "ABC", "AXC"),
        ("(a)|b", "[$1]", "ab", "[a][]"),
        ("a{2}", "X", "aaa", "Xa"),
        ("(?:ab)+?", "X", "abab", "XX"),
        ("ä", "x", "Ä", "Ä"),
    ],
)
def test_replacement_equals_std_regex(pattern: str, replacement: str, value: str, expected: str):
    assert replace_all(pattern, replacement, value) == expected


@pytest.mark.parametrize(
    "pattern",
    [
        "(",
        "[a",
        "*a",
        "a\\",
        "[[:digit:]]",
        "a{2,1}",
        ")",
    ],
)
def test_invalid_expression_is_refused(pattern: str):
    with pytest.raises(PatternError):
        replace_all(pattern, "x", "a")
