"""The order of values, sorting, the values in indexes, and the values in documents."""

from __future__ import annotations

import itertools
import re
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from cxbridge.clock import VirtualClock
from cxbridge_robot_memory.embedded import EmbeddedStore
from cxbridge_robot_memory.errors import DuplicateKeyError, QueryError
from cxbridge_robot_memory.values import ObjectId, Regex, Timestamp, order_key

C = "robmem.test"
NAN = float("nan")
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)

LADDER: list[list[Any]] = [
    # a rung has equal values; the order of rungs is MongoDB's order of types, and of values within a type
    [None],
    [NAN],
    [float("-inf")],
    [-(2**63), -(2.0**63)],
    [-1, -1.0],
    [0, 0.0, -0.0],
    [0.1],
    [2.0**53],
    [2**53 + 1],
    [2**63 - 1],
    [2.0**63],
    [float("inf")],
    [""],
    ["A"],
    ["a"],
    ["ab"],
    ["é"],
    ["\U0001f600"],
    [{}],
    [{"a": NAN}],
    [{"a": 1}, {"a": 1.0}],
    [{"b": NAN}],
    [{"b": 1}],
    [{"a": "x"}],
    [{"b": "x"}],
    [{"b": "x", "a": 1}],
    [[]],
    [[1], [1.0]],
    [[1, 0]],
    [[2]],
    [["x"]],
    [b""],
    [b"b"],
    [b"aa"],
    [ObjectId("1" * 24)],
    [ObjectId("2" * 24)],
    [False],
    [True],
    [EPOCH - timedelta(days=1)],
    [EPOCH],
    [Timestamp(0, 1)],
    [Timestamp(1, 0)],
    [Regex("a")],
    [Regex("b")],
]


def test_order_of_types_and_values():
    for rung in LADDER:
        for first, second in itertools.product(rung, rung):
            assert order_key(first) == order_key(second), (first, second)
            assert hash(order_key(first)) == hash(order_key(second)), (first, second)
    for below, above in itertools.combinations(LADDER, 2):
        assert order_key(below[0]) < order_key(above[0]), (below, above)


def test_sort_by_array_is_refused():
    store = EmbeddedStore(VirtualClock())
    store.insert(C, {"a": [1, 3]})
    with pytest.raises(QueryError, match="needs MongoDB"):
        store.find(C, sort={"b": 1, "a": 1})
    with pytest.raises(QueryError, match="direction"):
        store.find(C, sort={"a": 2})
    for keys, options in (({"a": 2}, {}), ({"a..b": 1}, {}), ({"a": 1}, {"unique": True})):
        with pytest.raises(QueryError):
            store.create_index(C, keys, **options)


# --- the values in documents ------------------------------------------------------------------------------


def nested(levels):
    """Return a document with nested levels of documents and arrays."""
    value: object = 1
    for number in range(levels):
        value = [value] if number % 2 else {"x": value}
    return {"_id": 1, "v": value}


def test_document_has_at_most_100_levels():
    store = EmbeddedStore(VirtualClock())
    store.insert(C, nested(99))
    store.remove(C, {})
    for levels in (101, 1000, 100_000):
        with pytest.raises(QueryError):
            store.insert(C, nested(levels))
    with pytest.raises(QueryError, match="levels"):
        store.find(C, {"v": nested(101)})
    store.insert(C, nested(60))
    with pytest.raises(QueryError, match="levels"):
        store.update(C, {}, {"$set": {".".join(f"b{number}" for number in range(120)): 1}})
    assert store.find(C) == [nested(60)]


def test_id_is_unchanged(tmp_path):
    store = EmbeddedStore(VirtualClock(), tmp_path / "memory.db")
    store.insert(C, {"_id": 1, "a": 1})
    with pytest.raises(QueryError, match="'_id'"):
        store.update(C, {}, {"_id": 1.0})
    with pytest.raises(DuplicateKeyError):
        store.insert(C, {"_id": 1.0})
    assert store.update(C, {}, {"_id": 1, "a": 2}) == 1
    store.close()
    reopened = EmbeddedStore(VirtualClock(), tmp_path / "memory.db")
    assert reopened.find(C) == [{"_id": 1, "a": 2}]
    reopened.close()


def test_names_of_fields_are_checked(tmp_path):
    store = EmbeddedStore(VirtualClock(), tmp_path / "memory.db")
    store.insert(C, {"_id": 1, "": 1, "a.b": 2})
    store.insert(C, {"_id": 2, "": 1})
    store.remove(C, {"_id": 2})
    with pytest.raises(QueryError, match="dollar"):
        store.insert(C, {"a": [{"$x": 3}]})
    store.close()
    reopened = EmbeddedStore(VirtualClock(), tmp_path / "memory.db")
    assert reopened.find(C, {"": 1}) == [{"_id": 1, "": 1, "a.b": 2}]
    assert reopened.find(C, {"a.b": 2}) == []
    reopened.close()


# --- regular expressions, events --------------------------------------------------------------------------


PATTERNS = [
    # pattern, options, whether the store refuses the pattern for a text of 60 letters
    ("(a+)+$", "", True),
    ("(a|a)*$", "", True),
    ("(?:ab){2}", "", True),
    ("a*a*a*a*a*$", "", True),
    (r"(a*)\1\1\1$", "", True),
    ("(a|a)" * 30, "", True),
    ("a?" * 30, "", True),
    ("^" + "a?" * 30, "", True),
    ("a.*b.*c", "", False),
    ("^a+b$", "", False),
    ("|".join(f"name{number}" for number in range(200)), "", False),
    (r"[)*+{]\)\*[^]*+)]*", "", False),
    ("^a*a*a*a*$", "", False),
    ("^a*a*a*a*$", "m", True),
]


@pytest.mark.parametrize(("pattern", "options", "refused"), PATTERNS, ids=lambda value: str(value)[:20])
def test_regular_expression_with_too_many_steps_is_refused(pattern, options, refused):
    store = EmbeddedStore(VirtualClock())
    store.insert(C, {"a": "a" * 59 + "b"})
    query = {"a": {"$regex": pattern, "$options": options}}
    if refused:
        with pytest.raises(QueryError, match="needs MongoDB"):
            store.find(C, query)
    else:
        assert len(store.find(C, query)) == bool(re.search(pattern, "a" * 59 + "b"))


def test_refused_update_leaves_document_unchanged():
    store = EmbeddedStore(VirtualClock())
    store.insert(C, {"_id": 1, "a": {"b": [1]}, "c": "text"})
    events: list[dict[str, object]] = []
    store.watch(C, {}, events.append)
    with pytest.raises(QueryError, match="'c' is not a number"):
        store.update(C, {}, {"$push": {"a.b": 2}, "$inc": {"c": 1}})
    assert store.find(C) == [{"_id": 1, "a": {"b": [1]}, "c": "text"}]
    assert events == []
