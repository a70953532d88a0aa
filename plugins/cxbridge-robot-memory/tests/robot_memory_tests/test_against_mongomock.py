"""The embedded store compared with mongomock, an independent implementation.

Generated documents, queries and updates avoid the differences of mongomock 4.3 from MongoDB's manual:
comparisons with None and True, empty documents, conflicting paths, and the order of new fields.
"""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cxbridge.clock import VirtualClock
from cxbridge_robot_memory.embedded import EmbeddedStore
from tests.support import many

mongomock = pytest.importorskip("mongomock")

C = "robmem.test"


def make_store(document: dict[str, Any]) -> EmbeddedStore:
    store = EmbeddedStore(VirtualClock())
    store.insert(C, {"_id": 1, **document})
    return store


def make_collection(document: dict[str, Any]) -> Any:
    collection = mongomock.MongoClient().robmem.test
    collection.insert_one({"_id": 1, **document})
    return collection


# --- inputs without defects of mongomock ------------------------------------------------------------------

SCALARS = st.sampled_from([None, 0, 1, 2, -1, 2.5, -1.5, "", "a", "b", "ab"])
COMPARABLE = st.sampled_from([0, 1, 2, -1, 2.5, "", "a", "b", "ab"])
FLAT = SCALARS | st.lists(SCALARS, max_size=3)
INNER = st.dictionaries(st.sampled_from("bc"), FLAT, min_size=1, max_size=2)
WHOLE = st.fixed_dictionaries({"b": FLAT, "c": FLAT})
BELOW = INNER | st.lists(WHOLE, min_size=1, max_size=3)
DOCUMENTS = st.fixed_dictionaries({}, optional={"a": FLAT, "d": BELOW})
PATHS = st.sampled_from(["a", "d.b", "d.c"])


def single_operator(names: str, operands: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """Draw documents with a single operator out of operators with equal operands."""
    return st.tuples(st.sampled_from(names.split()), operands).map(lambda parts: {parts[0]: parts[1]})


def operators() -> st.SearchStrategy[Any]:
    return st.one_of(
        single_operator("$gt $gte $lt $lte", COMPARABLE),
        single_operator("$eq $ne", SCALARS),
        single_operator("$in $nin", st.lists(SCALARS, max_size=3)),
        single_operator("$exists", st.booleans()),
        single_operator("$regex", st.sampled_from(["^a", "b$", "."])),
    )


CONDITIONS = (
    SCALARS
    | st.lists(SCALARS, min_size=1, max_size=2)
    | operators()
    | operators().map(lambda condition: {"$not": condition})
)
FIELDS = st.dictionaries(PATHS, CONDITIONS, min_size=1, max_size=2)
LOGICAL = st.tuples(st.sampled_from(["$or", "$and"]), st.lists(FIELDS, min_size=1, max_size=2))
QUERIES = FIELDS | LOGICAL.map(lambda parts: {parts[0]: parts[1]})


@settings(max_examples=many(400, 100), suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(DOCUMENTS, QUERIES)
def test_queries_equal_mongomock(document, query):
    assert bool(make_store(document).find(C, query)) == bool(list(make_collection(document).find(query)))


ARRAYS = st.dictionaries(st.sampled_from("ab"), st.lists(COMPARABLE, max_size=3), min_size=2, max_size=2)
UPDATES = st.one_of(
    COMPARABLE.map(lambda value: {"$push": {"a": value}}),
    COMPARABLE.map(lambda value: {"$set": {"b": value}}),
    st.just({"$unset": {"b": 1}}),
    st.sampled_from([1, -1, 0.5]).map(lambda value: {"$inc": {"n": value, "c.d": value}}),
    COMPARABLE.map(lambda value: {"$set": {"e.f": value}, "$unset": {"b": 1}}),
)


@settings(max_examples=many(200, 50), deadline=None)
@given(ARRAYS, st.lists(UPDATES, min_size=1, max_size=3))
def test_updates_equal_mongomock(document, updates):
    store, collection = make_store(document), make_collection(document)
    for update in updates:
        store.update(C, {}, update)
        collection.update_one({}, update)
        assert store.find(C) == [collection.find_one({})]
