from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cxbridge.blackboard import errors, parse_uid
from cxbridge.blackboard.names import check_names, matches

TYPES = st.from_regex(r"[A-Za-z0-9_]{1,48}", fullmatch=True)
IDS = st.text(st.characters(codec="ascii", exclude_characters="\0"), min_size=1, max_size=64)


@settings(deadline=None)
@given(TYPES, IDS)
def test_uid_splits_into_type_and_id(interface_type, interface_id):
    check_names(interface_type, interface_id)
    assert parse_uid(f"{interface_type}::{interface_id}") == (interface_type, interface_id)


@pytest.mark.parametrize("uid", ["", "Sample", "Sample:a", "Sample::", "::a", "Sam ple::a", "Sample\n::a"])
def test_invalid_uid_is_refused(uid):
    with pytest.raises(errors.InvalidNameError) as caught:
        parse_uid(uid)
    assert caught.value.message == f"Failed to match UID {uid}, format error."


def test_limit_of_id_counts_bytes():
    check_names("T", "ä" * 32)
    with pytest.raises(errors.InvalidNameError, match="maximum length is 64"):
        check_names("T", "ä" * 33)


@settings(deadline=None)
@given(st.text(max_size=70), st.text(max_size=70))
def test_names_are_valid_or_refused(interface_type, interface_id):
    try:
        check_names(interface_type, interface_id)
    except errors.InvalidNameError:
        return
    assert 0 < len(interface_type) <= 48
    assert 0 < len(interface_id) <= 64


def test_patterns_match_as_in_shell_with_case():
    assert matches("SampleInterface", "/a/b", "*", "/a/*")
    assert matches("SampleInterface", "a1", "Sample[IJ]*", "a?")
    assert not matches("SampleInterface", "a1", "sample*", "*")
    assert not matches("SampleInterface", "a1", "*", "a")
