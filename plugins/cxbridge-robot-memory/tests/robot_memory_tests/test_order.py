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
    # equal values share a rung; the rungs are MongoDB's order of types, and of values within a type
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


def test_the_order_of_types_and_values():
    for rung in LADDER:
        for one, other in itertools.product(rung, rung):
            assert order_key(one) == order_key(other), (one, other)
            assert hash(order_key(one)) == hash(order_key(other)), (one, other)
    for below, above in itertools.combinations(LADDER, 2):
        assert order_key(below[0]) < order_key(above[0]), (below, above)


def test_sorting_is_stable_and_a_limit_takes_the_first():
    store = EmbeddedStore(VirtualClock())
    for number in range(20):
        store.insert(C, {"_id": number, "v": number % 3})
    expected = sorted(range(20), key=lambda number: number % 3)
    assert [each["_id"] for each in store.find(C, sort={"v": 1}, limit=9)] == expected[:9]
    down = sorted(range(20), key=lambda number: -(number % 3))
    assert [each["_id"] for each in store.find(C, sort={"v": -1})] == down


def test_an_order_through_an_array_is_refused():
    store = EmbeddedStore(VirtualClock())
    store.insert(C, {"a": [1, 3]})
    with pytest.raises(QueryError, match="needs MongoDB"):
        store.find(C, sort={"b": 1, "a": 1})
    with pytest.raises(QueryError, match="direction"):
        store.find(C, sort={"a": 2})
    with pytest.raises(QueryError, match="limit"):
        store.find(C, limit=-1)


# --- indexes ----------------------------------------------------------------------------------------------

UNIQUE = [
    # keys, two documents, whether they may be in the same collection
    ({"a": 1}, {"a": 1}, {"a": 1.0}, False),
    ({"a": 1}, {"a": 1}, {"a": "1"}, True),
    ({"a": 1}, {}, {}, False),
    ({"a": 1}, {}, {"a": None}, False),
    ({"a": 1, "b": 1}, {"a": 1, "b": 1}, {"a": 1, "b": 2}, True),
]


@pytest.mark.parametrize(("keys", "one", "other", "allowed"), UNIQUE, ids=str)
def test_a_unique_index(keys, one, other, allowed):
    before, after = EmbeddedStore(VirtualClock()), EmbeddedStore(VirtualClock())
    before.create_index(C, keys, unique=True)
    before.insert(C, one)
    after.insert(C, one)
    after.insert(C, other)
    if allowed:
        before.insert(C, other)
        after.create_index(C, keys, unique=True)
        return
    with pytest.raises(DuplicateKeyError):
        before.insert(C, other)
    with pytest.raises(DuplicateKeyError):
        after.create_index(C, keys, unique=True)


def test_a_unique_index_on_an_array_is_refused():
    store = EmbeddedStore(VirtualClock())
    store.create_index(C, {"a.x": 1}, unique=True)
    for value in ([1], {"x": [1]}, [{"x": 1}]):
        with pytest.raises(QueryError, match="needs MongoDB"):
            store.insert(C, {"a": value})
    assert store.find(C) == []


def test_an_index_with_other_options_is_refused():
    store = EmbeddedStore(VirtualClock())
    store.create_index(C, {"a": 1}, unique=True)
    store.create_index(C, {"a": 1}, unique=True)
    with pytest.raises(QueryError, match="already exists with other options"):
        store.create_index(C, {"a": 1})
    store.create_index(C, {"t": 1}, expire_after_s=10)
    with pytest.raises(QueryError, match="already exists with other options"):
        store.create_index(C, {"t": 1}, expire_after_s=20)
    keys: dict[str, int]
    for keys in ({}, {"a": 2}, {"a..b": 1}):
        with pytest.raises(QueryError):
            store.create_index(C, keys)
    with pytest.raises(QueryError, match="'_id'"):
        store.create_index(C, {"_id": 1}, expire_after_s=1)


def test_indexes_survive_in_the_file(tmp_path):
    file = tmp_path / "memory.db"
    store = EmbeddedStore(VirtualClock(), file)
    store.create_index(C, {"a": 1, "b": -1}, unique=True)
    store.create_index("robmem.dropped", {"a": 1}, unique=True)
    store.drop("robmem.dropped")
    store.create_index(C, {"t": 1}, expire_after_s=10)
    store.insert(C, {"_id": 1, "a": 1, "t": EPOCH})
    store.close()
    clock = VirtualClock()
    again = EmbeddedStore(clock, file)
    with pytest.raises(DuplicateKeyError):
        again.insert(C, {"_id": 2, "a": 1})
    again.insert("robmem.dropped", {"a": 1})
    again.insert("robmem.dropped", {"a": 1})
    again.remove_expired()
    assert again.find(C) == []
    again.close()


def test_of_several_times_the_first_counts():
    clock = VirtualClock()
    store = EmbeddedStore(clock)
    store.create_index(C, {"t": 1}, expire_after_s=10)
    now = datetime.fromtimestamp(clock.now_us() / 1e6, UTC)
    store.insert(C, {"_id": 1, "t": ["x", now, now - timedelta(seconds=11)]})
    store.insert(C, {"_id": 2, "t": [now, now - timedelta(seconds=9)]})
    store.remove_expired()
    assert [each["_id"] for each in store.find(C)] == [2]


# --- the values in documents ------------------------------------------------------------------------------


def nested(levels):
    """Return a document with a number of levels of documents and arrays below it."""
    value: object = 1
    for number in range(levels):
        value = [value] if number % 2 else {"x": value}
    return {"_id": 1, "v": value}


def test_a_document_has_at_most_a_hundred_levels():
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


@pytest.mark.parametrize("identity", [[1], Regex("x")])
def test_what_is_no_id_is_refused(identity):
    store = EmbeddedStore(VirtualClock())
    with pytest.raises(QueryError, match="'_id'"):
        store.insert(C, {"_id": identity})


def test_the_id_stays_to_the_byte(tmp_path):
    store = EmbeddedStore(VirtualClock(), tmp_path / "memory.db")
    store.insert(C, {"_id": 1, "a": 1})
    with pytest.raises(QueryError, match="'_id'"):
        store.update(C, {}, {"_id": 1.0})
    with pytest.raises(DuplicateKeyError):
        store.insert(C, {"_id": 1.0})
    assert store.update(C, {}, {"_id": 1, "a": 2}) == 1
    store.close()
    again = EmbeddedStore(VirtualClock(), tmp_path / "memory.db")
    assert again.find(C) == [{"_id": 1, "a": 2}]
    again.close()


def test_names_of_fields(tmp_path):
    store = EmbeddedStore(VirtualClock(), tmp_path / "memory.db")
    store.insert(C, {"_id": 1, "": 1, "a.b": 2})
    with pytest.raises(QueryError, match="dollar"):
        store.insert(C, {"a": [{"$x": 3}]})
    store.close()
    again = EmbeddedStore(VirtualClock(), tmp_path / "memory.db")
    assert again.find(C, {"": 1}) == [{"_id": 1, "": 1, "a.b": 2}]
    assert again.find(C, {"a.b": 2}) == []
    again.close()


# --- regular expressions, events --------------------------------------------------------------------------


PATTERNS = [
    # pattern, options, whether MongoDB is needed on a text of 60 letters
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
def test_a_regular_expression_of_too_many_steps_is_refused(pattern, options, refused):
    store = EmbeddedStore(VirtualClock())
    store.insert(C, {"a": "a" * 59 + "b"})
    query = {"a": {"$regex": pattern, "$options": options}}
    if refused:
        with pytest.raises(QueryError, match="needs MongoDB"):
            store.find(C, query)
    else:
        assert len(store.find(C, query)) == bool(re.search(pattern, "a" * 59 + "b"))


EVENTS = [
    # update, updatedFields and removedFields of its event
    ({"$push": {"l": 3}}, {"l.2": 3}, []),
    ({"$push": {"new": 3}}, {"new": [3]}, []),
    ({"$unset": {"l": 1, "a": 1}}, {}, ["a", "l"]),
    ({"$set": {"x.y": 1}}, {"x.y": 1}, []),
]


@pytest.mark.parametrize(("update", "fields", "removed"), EVENTS, ids=str)
def test_what_an_event_says_of_an_update(update, fields, removed):
    store = EmbeddedStore(VirtualClock())
    store.insert(C, {"_id": 1, "a": 1, "l": [1, 2]})
    told: list[dict[str, object]] = []
    store.watch(C, {}, told.append)
    store.update(C, {}, update)
    (event,) = told
    assert event["updateDescription"] == {
        "updatedFields": fields,
        "removedFields": removed,
        "truncatedArrays": [],
    }


@pytest.mark.parametrize(
    "update",
    [
        {"$unset": {"z": 1}},
        {"$set": {"a": 1}},
        {"$inc": {"a": 0}},
    ],
    ids=str,
)
def test_an_update_that_changes_nothing_is_no_event(update):
    store = EmbeddedStore(VirtualClock())
    store.insert(C, {"_id": 1, "a": 1, "l": [1, 2]})
    told: list[dict[str, object]] = []
    store.watch(C, {}, told.append)
    assert store.update(C, {}, update) == 1
    assert told == []


def test_an_update_that_is_refused_in_the_midst_leaves_the_document():
    store = EmbeddedStore(VirtualClock())
    store.insert(C, {"_id": 1, "a": {"b": [1]}, "c": "text"})
    told: list[dict[str, object]] = []
    store.watch(C, {}, told.append)
    with pytest.raises(QueryError, match="'c' is not a number"):
        store.update(C, {}, {"$push": {"a.b": 2}, "$inc": {"c": 1}})
    assert store.find(C) == [{"_id": 1, "a": {"b": [1]}, "c": "text"}]
    assert told == []
