"""The keys of the check equal the keys of the manual."""

from __future__ import annotations

import re

from cxbridge_studio.check.keys import find_unknown_name, list_known_keys
from tests.support import ROOT

PAGE = (ROOT / "docs" / "configuration.md").read_text()
LISTED = [
    tuple(key.strip("/").split("/"))
    for row in re.findall(r"^\| (`/[^|]*)\|", PAGE, re.MULTILINE)
    for key in re.findall(r"`([^`]*)`", row)
]


def test_check_knows_each_key_of_page() -> None:
    assert LISTED
    assert [key for key in LISTED if find_unknown_name(key) is not None] == []


def _covers(listed: tuple[str, ...], key: tuple[str, ...]) -> bool:
    """Whether the keys are equal, or the check accepts all keys at this place."""
    for a, b in zip(listed, key, strict=False):
        if "..." in (a, b):
            return True
        if a != b and not (a.isupper() and b.isupper()):
            return False
    return len(listed) == len(key)


def test_page_lists_each_key_of_check() -> None:
    assert [key for key in list_known_keys() if not any(_covers(listed, key) for listed in LISTED)] == []


def test_misspelt_part_of_each_key_is_found_at_its_place() -> None:
    paths = [
        (*key[:index], f"{part}x")
        for key in list_known_keys()
        for index, part in enumerate(key)
        if part.islower()
    ]
    assert len(paths) > 100
    places = {path: find_unknown_name(path) for path in paths}
    assert {path: place for path, place in places.items() if place is None or place[0] != len(path) - 1} == {}
