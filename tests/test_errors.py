"""How errors show themselves."""

from __future__ import annotations

import pytest

from cxbridge.errors import ConfigError, CxbridgeError


@pytest.mark.parametrize(
    ("place", "text"),
    [
        ({}, "wrong"),
        ({"file": "f"}, "f: wrong"),
        ({"file": "f", "line": 3}, "f:3: wrong"),
        ({"file": "f", "line": 3, "column": 7}, "f:3:7: wrong"),
        ({"file": "f", "line": 3, "hint": "mend it"}, "f:3: wrong\n  hint: mend it"),
    ],
)
def test_place_message_and_hint(place, text):
    assert str(ConfigError("wrong", **place)) == text


def test_bad_input_is_status_2():
    assert CxbridgeError("x").exit_status == 2
