"""The behaviour of all stores."""

from __future__ import annotations

import threading
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from cxbridge_robot_memory.errors import DuplicateKeyError, QueryError
from cxbridge_robot_memory.values import ObjectId, Regex, Timestamp

C = "robmem.test"
NOW = datetime(2026, 1, 2, 3, 4, 5, 678000, tzinfo=UTC)


def fill(store, *documents):
    for document in documents:
        store.insert(C, document)


def ids(documents):
    return [document["_id"] for document in documents]


class Events:
    """The events of a watch."""

    def __init__(self, store, query=None, collection=C):
        self._arrived = threading.Condition()
        self._events = []
        self.watch = store.watch(collection, query or {}, self._take)

    def _take(self, event):
        with self._arrived:
            self._events.append(event)
            self._arrived.notify_all()

    def first(self, count):
        """Wait for a number of events, and return them."""
        with self._arrived:
            assert self._arrived.wait_for(lambda: len(self._events) >= count, 20), self._events
            return self._events[:count]


# --- documents --------------------------------------------------------------------------------------------


def test_document_is_returned_unchanged(store):
    document = {
        "_id": "x",
        "double": 1.5,
        "int": 7,
        "long": 2**40,
        "text": "käse",
        "true": True,
        "time": NOW,
        "nothing": None,
        "list": [1, [2, {"a": "b"}], "c"],
        "below": {"b": 1, "a": {"x": []}},
        "pattern": Regex("^a", "i"),
        "stamp": Timestamp(5, 1),
    }
    store.insert(C, document)
    assert store.find(C) == [document]
    assert list(store.find(C)[0]["below"]) == ["b", "a"]
    assert store.find(C)[0]["true"] is True


def test_stored_document_is_a_copy(store):
    document: dict[str, Any] = {"_id": 1, "list": [1]}
    store.insert(C, document)
    document["list"] += [2]
    store.find(C)[0]["list"].append(3)
    assert store.find(C) == [{"_id": 1, "list": [1]}]


def test_missing_id_is_generated(store):
    first, second = store.insert(C, {"a": 1}), store.insert(C, {"a": 2})
    assert isinstance(first, ObjectId)
    assert first != second
    assert store.find(C, {"_id": first}) == [{"_id": first, "a": 1}]


def test_duplicate_id_is_refused(store):
    fill(store, {"_id": "x", "a": 1})
    with pytest.raises(DuplicateKeyError):
        store.insert(C, {"_id": "x", "a": 2})
    assert store.find(C) == [{"_id": "x", "a": 1}]


@pytest.mark.parametrize("document", [{"a": object()}, {"a": 2**80}, {1: 2}])
def test_invalid_document_is_refused(store, document):
    with pytest.raises(QueryError):
        store.insert(C, document)


@pytest.mark.parametrize("name", ["robmem", "", ".x", "x.", "a.$b", "a." + 200 * "b"])
def test_invalid_collection_is_refused(store, name):
    with pytest.raises(QueryError):
        store.insert(name, {"a": 1})


# --- queries ----------------------------------------------------------------------------------------------

DOCUMENTS = (
    {"_id": 0, "a": 1, "b": "x"},
    {"_id": 1, "a": 2.0, "b": "y"},
    {"_id": 2, "a": True},
    {"_id": 3, "a": None},
    {"_id": 4, "b": ["x", "z"]},
    {"_id": 5, "a": {"b": {"c": 3}, "d": 1}},
    {"_id": 6, "a": [{"b": 1, "c": 5}, {"b": 2, "c": 6}]},
    {"_id": 7, "a": "2", "t": NOW},
    {"_id": 8, "a": [1, 2, 3]},
)

QUERIES = [
    ({}, [0, 1, 2, 3, 4, 5, 6, 7, 8]),
    ({"a": 1}, [0, 8]),
    ({"a": 1.0}, [0, 8]),
    ({"a": True}, [2]),
    ({"a": None}, [3, 4]),
    ({"b": "x"}, [0, 4]),
    ({"b": ["x", "z"]}, [4]),
    ({"a": [1, 2]}, []),
    ({"a": {"b": {"c": 3}, "d": 1}}, [5]),
    ({"a": {"d": 1, "b": {"c": 3}}}, []),
    ({"a.b.c": 3}, [5]),
    ({"a.b": 2}, [6]),
    ({"a": {"$gt": 1}}, [1, 8]),
    ({"a": {"$gte": 1, "$lt": 2}}, [0, 8]),
    ({"a": {"$lte": "2"}}, [7]),
    ({"t": {"$lte": NOW}}, [7]),
    ({"t": {"$lt": NOW}}, []),
    ({"a": {"$ne": 1}}, [1, 2, 3, 4, 5, 6, 7]),
    ({"a": {"$in": [1, "2", None]}}, [0, 3, 4, 7, 8]),
    ({"a": {"$nin": [1, "2", None]}}, [1, 2, 5, 6]),
    ({"b": {"$in": [Regex("^[xy]$")]}}, [0, 1, 4]),
    ({"a": {"$exists": True}}, [0, 1, 2, 3, 5, 6, 7, 8]),
    ({"a": {"$exists": False}}, [4]),
    ({"b": Regex("^X", "i")}, [0, 4]),
    ({"b": {"$regex": "^X", "$options": "i"}}, [0, 4]),
    ({"b": {"$not": {"$regex": "x"}}}, [1, 2, 3, 5, 6, 7, 8]),
    ({"$or": [{"a": 1}, {"b": "y"}]}, [0, 1, 8]),
    ({"$and": [{"a": {"$gt": 0}}, {"b": "y"}]}, [1]),
    ({"_id": {"$gt": 6}}, [7, 8]),
    ({"a": 1, "b": "x"}, [0]),
]


@pytest.mark.parametrize(("query", "expected"), QUERIES, ids=lambda value: str(value)[:60])
def test_query_finds_expected_documents(store, query, expected):
    fill(store, *DOCUMENTS)
    assert sorted(ids(store.find(C, query))) == expected


@pytest.mark.parametrize(
    "query",
    [{"a": {"$near": 1}}, {"$where": "1"}, {"$or": []}, {"a": {"$in": 1}}, {"a": {"$regex": "("}}],
    ids=str,
)
def test_invalid_query_is_refused(store, query):
    fill(store, *DOCUMENTS)
    with pytest.raises(QueryError):
        store.find(C, query)


def test_found_documents_are_sorted_by_type_and_value(store):
    fill(store, {"_id": 1, "a": "b"}, {"_id": 2, "a": 3}, {"_id": 3}, {"_id": 4, "a": -1.5})
    fill(store, {"_id": 5, "a": True}, {"_id": 6, "a": "a"}, {"_id": 7, "a": NOW})
    assert ids(store.find(C, sort={"a": 1})) == [3, 4, 2, 6, 1, 5, 7]
    fill(store, {"_id": 8, "a": 3}, {"_id": 0, "a": 3})
    assert ids(store.find(C, {"a": 3}, sort={"a": -1, "_id": 1})) == [0, 2, 8]


# --- updates ----------------------------------------------------------------------------------------------


def test_plain_fields_are_set(store):
    fill(store, {"_id": 1, "a": 1, "b": 1}, {"_id": 2, "a": 1}, {"_id": 3, "a": 2})
    assert store.update(C, {"a": 1}, {"b": 5, "c.d": 6}) == 2
    assert store.find(C, {"a": 1}, sort={"_id": 1}) == [
        {"_id": 1, "a": 1, "b": 5, "c": {"d": 6}},
        {"_id": 2, "a": 1, "b": 5, "c": {"d": 6}},
    ]
    assert store.update(C, {"a": 7}, {"b": 1}) == 0


def test_type_of_number_may_change(store):
    fill(store, {"_id": 1, "a": 1})
    store.update(C, {"_id": 1}, {"a": 1.0})
    assert isinstance(store.find(C)[0]["a"], float)


def test_upsert_makes_document_of_query_and_changes(store):
    assert store.update(C, {"name": "x", "n": {"$gt": 3}, "k": {"$eq": 2}}, {"v": 1}, upsert=True) == 1
    (document,) = store.find(C)
    assert {name: document[name] for name in document if name != "_id"} == {"name": "x", "k": 2, "v": 1}
    assert store.update(C, {"name": "x"}, {"v": 2}, upsert=True) == 1
    assert [document["v"] for document in store.find(C)] == [2]


def test_upsert_with_existing_id_is_refused(store):
    older = NOW - timedelta(seconds=1)
    fill(store, {"_id": "/a", "update-timestamp": NOW, "value": 1})
    with pytest.raises(DuplicateKeyError):
        store.update(
            C,
            {"_id": "/a", "update-timestamp": {"$lte": older}},
            {"_id": "/a", "update-timestamp": older, "value": 2},
            upsert=True,
        )
    assert store.find(C)[0]["value"] == 1


def test_update_operators_are_applied(store):
    fill(store, {"_id": 1, "a": 1, "b": {"c": 1, "d": 2}, "l": [1]})
    store.update(C, {"_id": 1}, {"$inc": {"a": 2}, "$unset": {"b.c": ""}, "$push": {"l": 2}})
    store.update(C, {"_id": 1}, {"$set": {"a": 4}}, upsert=True)
    assert store.find(C) == [{"_id": 1, "a": 4, "b": {"d": 2}, "l": [1, 2]}]


@pytest.mark.parametrize(
    "changes",
    [
        {"$rename": 1},
        {"$frobnicate": {"a": 1}},
        {"$set": {"_id": 2}},
        {"$inc": {"b": 1}},
        {"$set": {"b.c": 1}},
    ],
    ids=str,
)
def test_invalid_update_is_refused(store, changes):
    fill(store, {"_id": 1, "b": "text"})
    with pytest.raises(QueryError):
        store.update(C, {"_id": 1}, changes)
    assert store.find(C) == [{"_id": 1, "b": "text"}]


def test_find_one_and_update_returns_new_document(store):
    fill(store, {"_id": 1, "a": 1}, {"_id": 2, "a": 1})
    assert store.find_one_and_update(C, {"_id": 2}, {"$set": {"b": 1}}) == {"_id": 2, "a": 1, "b": 1}
    assert store.find_one_and_update(C, {"_id": 3}, {"$set": {"b": 1}}) is None
    assert store.find_one_and_update(C, {"_id": 3}, {"$set": {"b": 1}}, upsert=True) == {"_id": 3, "b": 1}


def test_remove_returns_number_of_documents(store):
    fill(store, *DOCUMENTS)
    assert store.remove(C, {"a": 1}) == 2
    assert store.remove(C, {}) == 7
    assert store.find(C) == []


# --- changes ----------------------------------------------------------------------------------------------


def test_watch_has_events_in_order(store):
    events = Events(store)
    store.insert(C, {"_id": 1, "a": 1, "b": 1})
    store.update(C, {"_id": 1}, {"$set": {"a": 2}, "$unset": {"b": 1}})
    store.update(C, {"_id": 2}, {"a": 3}, upsert=True)
    store.insert("robmem.other", {"_id": 1})
    store.remove(C, {"_id": 1})
    received = events.first(4)
    assert [event["operationType"] for event in received] == ["insert", "update", "insert", "delete"]
    assert received[0]["fullDocument"] == {"_id": 1, "a": 1, "b": 1}
    assert received[1]["fullDocument"] == {"_id": 1, "a": 2}
    assert received[3]["documentKey"] == {"_id": 1}
    assert "fullDocument" not in received[3]
    assert all(event["ns"] == {"db": "robmem", "coll": "test"} for event in received)
    stamps = [event["clusterTime"] for event in received]
    assert stamps == sorted(set(stamps), key=lambda stamp: (stamp.time, stamp.inc))


def test_update_without_change_has_no_event(store):
    fill(store, {"_id": 1, "a": 1})
    events = Events(store)
    assert store.update(C, {"_id": 1}, {"a": 1}) == 1
    store.update(C, {"_id": 1}, {"a": 2})
    assert events.first(1)[0]["fullDocument"]["a"] == 2


def test_watch_has_matching_events_only(store):
    events = Events(store, {"operationType": "insert", "fullDocument.kind": "good"})
    fill(store, {"_id": 1, "kind": "bad"}, {"_id": 2, "kind": "good"})
    store.update(C, {}, {"kind": "good"})
    fill(store, {"_id": 3, "kind": "good"})
    assert [event["documentKey"]["_id"] for event in events.first(2)] == [2, 3]
    events.watch.close()
    fill(store, {"_id": 4, "kind": "good"})
    # a thread that still runs could report the event after the assertion
    assert (
        getattr(events.watch, "_thread", None) in threading.enumerate(),
        len(events._events),
    ) == (False, 2)
