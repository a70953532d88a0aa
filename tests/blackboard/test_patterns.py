"""Patterns for interfaces on the command line."""

from __future__ import annotations

from fnmatch import fnmatchcase

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.blackboard.errors import InvalidNameError
from cxbridge.blackboard.patterns import Pattern, escape_glob


@pytest.mark.parametrize(
    ("text", "key", "selected"),
    [
        ("*", ("AInterface", "x::y"), True),
        ("AInterface", ("AInterface", "x"), True),
        ("A*::x", ("AInterface", "x"), True),
        ("A*::x", ("AInterface", "y"), False),
        ("[!B]*::x::*", ("AInterface", "x::y"), True),
        ("a*", ("AInterface", "x"), False),
    ],
)
def test_pattern_selects_matching_keys(text, key, selected):
    assert Pattern.parse(text).matches(key) is selected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "type may not be empty"),
        ("::x", "type may not be empty"),
        ("A::", "ID may not be empty"),
        ("A:x", "'A:x' cannot match a type's name"),
        ("A/x", "cannot match a type's name"),
        ("A" * 49, "too long"),
    ],
)
def test_pattern_without_possible_match_is_refused(text, message):
    with pytest.raises(InvalidNameError, match=message) as caught:
        Pattern.parse(text)
    assert "TYPE::ID" in str(caught.value)


@given(st.text("a*?[]!", min_size=1, max_size=6), st.text("a*?[]!", min_size=1, max_size=6))
def test_escaped_name_matches_only_itself(name, other):
    assert fnmatchcase(name, escape_glob(name))
    assert fnmatchcase(other, escape_glob(name)) == (other == name)
