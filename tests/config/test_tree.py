"""The tree: keys with slashes, lists, duplicates, and overlays."""

from __future__ import annotations

from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cxbridge.config import Configuration
from cxbridge.errors import ConfigError

patient = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])


def values(config: Configuration, prefix: str = "/") -> dict[str, Any]:
    return {value.path: list(value.items) if value.is_list else value.text for value in config.search(prefix)}


def test_empty_and_null_values_are_leaves() -> None:
    config = Configuration.from_text("a:\nb: []\nc: {}\nd: [~, x]\n")
    assert values(config) == {"/a": "", "/b": [], "/c": "", "/d": ["null", "x"]}


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("a:\n- [1, 2]\n", 2, "must be single values"),
        ("a:\n- x\n- y: 1\n", 3, "must be single values"),
        ("? [a, b]\n: 1\n", 1, "a key must be a single word"),
        ("a: 1\n/: 2\n", 2, "is not a key"),
        ("a: 1\na/b: 2\n", 2, "not a map"),
        ("a: 1\na: [2]\n", 2, "a list, but a single value in line 1"),
        ("- a\n- b\n", 1, "must be a map"),
        ("just text\n", 1, "must be a map"),
    ],
)
def test_invalid_trees_are_errors(text: str, line: int, message: str) -> None:
    with pytest.raises(ConfigError, match=message) as caught:
        Configuration.from_text(text, "c.yaml")
    assert (caught.value.file, caught.value.line) == ("c.yaml", line)


@pytest.mark.parametrize(
    "text", ["/".join("a" * 101) + ": 1", f"{'/'.join('a' * 60)}:\n  {'/'.join('b' * 60)}: 1"]
)
def test_paths_of_keys_are_bounded(text: str) -> None:
    with pytest.raises(ConfigError, match="nested more than 100 deep"):
        Configuration.from_text(text)


def test_later_duplicate_replaces_and_warns() -> None:
    config = Configuration.from_text("a: {x: 1, y: 2}\nb: 1\na: {x: 3}\n", "c.yaml")
    assert values(config) == {"/a/x": "3", "/b": "1"}
    assert config.warnings == ("c.yaml:3: 'a' replaces the value in line 1",)


def test_overlay_merges_maps_and_replaces_lists_and_scalars() -> None:
    config = Configuration.from_text("m: {a: 1, b: 2}\nl: [1, 2, 3]\ns:\n- x: 1\n- x: 2\nn:\n")
    config.overlay(Configuration.from_text("m: {b: text, c: 4}\nl: [9]\ns:\n- y: 5\nn: {deep: 1}\n"))
    assert values(config) == {
        "/l": ["9"],
        "/m/a": "1",
        "/m/b": "text",
        "/m/c": "4",
        "/n/deep": "1",
        "/s/0/y": "5",
    }


@pytest.mark.parametrize(
    ("below", "above"),
    [("a: 1", "a: [1]"), ("a: [1]", "a: 1"), ("a: {b: 1}", "a: 1"), ("a: 1", "a: {b: 1}"), ("a: 1", "a:"),
     ("a: [{b: 1}]", "a: {b: 1}"), ("a: {b: 1}", "a: [{b: 1}]")],
)  # fmt: skip
def test_error_of_incompatible_overlay_has_both_places(below: str, above: str) -> None:
    config = Configuration.from_text(below, "below.yaml")
    with pytest.raises(ConfigError) as caught:
        config.overlay(Configuration.from_text(f"\n{above}", "above.yaml"))
    assert (caught.value.file, caught.value.line) == ("above.yaml", 2)
    assert "below.yaml:1" in caught.value.message


def test_overlay_does_not_share_nodes() -> None:
    base, over = Configuration.from_text("a: {x: 1}"), Configuration.from_text("b: {y: 2}")
    base.overlay(over)
    base.set("/b/y", 3)
    assert over.get_uint("/b/y") == 2


_KEY = st.from_regex(r"[a-zA-Z0-9_.-]{1,8}", fullmatch=True)
_TEXT = st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"]), max_size=12)
_LEAF = _TEXT | st.lists(_TEXT, max_size=4)
_TREE = st.recursive(
    st.dictionaries(_KEY, _LEAF, min_size=1, max_size=4),
    lambda inner: st.dictionaries(
        _KEY, inner | _LEAF | st.lists(inner, min_size=1, max_size=3), min_size=1, max_size=4
    ),
    max_leaves=12,
)


def flat(tree: Any, prefix: str = "") -> dict[str, Any]:
    items = tree.items() if isinstance(tree, dict) else ((str(n), item) for n, item in enumerate(tree))
    result: dict[str, Any] = {}
    for key, value in items:
        if isinstance(value, dict) or (isinstance(value, list) and value and isinstance(value[0], dict)):
            result |= flat(value, f"{prefix}/{key}")
        else:
            result[f"{prefix}/{key}"] = value
    return result


@patient
@given(_TREE)
def test_random_trees_are_read_back_in_order(tree: dict[str, Any]) -> None:
    text = yaml.safe_dump(tree, allow_unicode=True)
    expected = flat(tree)
    config = Configuration.from_text(text)
    assert values(config) == expected
    assert [value.path for value in config.search()] == sorted(expected)
