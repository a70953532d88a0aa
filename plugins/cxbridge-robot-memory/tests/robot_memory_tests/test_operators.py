"""The embedded store follows MongoDB's manual for an operator, or refuses the operator by its name."""

from __future__ import annotations

import re
from typing import Any

import pytest

from cxbridge.clock import VirtualClock
from cxbridge_robot_memory.embedded import EmbeddedStore
from cxbridge_robot_memory.errors import QueryError
from cxbridge_robot_memory.update import Update
from cxbridge_robot_memory.values import is_identical, validated_copy
from robot_memory_tests import mongodb_cases as mongodb
from robot_memory_tests import mongodb_names as names

C = "robmem.test"


def cases(table: dict[str, list[Any]]) -> list[Any]:
    """Return the rows of a table of operators with the operator first."""
    return [(name, *row) for name, rows in table.items() for row in rows]


def short_id(value: object) -> str:
    return str(value)[:50]


@pytest.fixture
def embedded() -> EmbeddedStore:
    return EmbeddedStore(VirtualClock())


# --- documented operators ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("_name", "document", "condition", "expected"), cases(mongodb.QUERY_CASES), ids=short_id
)
@pytest.mark.parametrize("other_documents", [0, 40])
def test_query_finds_documented_documents(embedded, _name, document, condition, expected, other_documents):
    for number in range(other_documents):  # enough documents for an index
        embedded.insert(C, {"_id": number, "other": number})
    embedded.insert(C, {"_id": "searched", **document})
    query = condition["query"] if isinstance(condition, dict) and "query" in condition else {"a": condition}
    found = [result["_id"] for result in embedded.find(C, query)]
    assert ("searched" in found) is expected


@pytest.mark.parametrize(("query", "part"), mongodb.BAD_QUERIES, ids=short_id)
def test_query_refused_by_mongodb_is_refused(embedded, query, part):
    with pytest.raises(QueryError, match=re.escape(part)):
        embedded.find(C, query)  # the collection is empty


@pytest.mark.parametrize(
    ("_name", "document", "update", "expected"), cases(mongodb.UPDATE_CASES), ids=short_id
)
def test_update_makes_documented_document(_name, document, update, expected):
    before = {"_id": 1, **document}
    if isinstance(expected, str):
        with pytest.raises(QueryError, match=re.escape(expected)):
            Update(validated_copy(update)).apply(validated_copy(before), mongodb.NOW)
        return
    changed = Update(validated_copy(update)).apply(validated_copy(before), mongodb.NOW)
    # types of numbers and the order of fields count
    if changed is None:
        assert is_identical(before, {"_id": 1, **expected})
    else:
        assert is_identical(changed, {"_id": 1, **expected})
        assert not is_identical(before, changed)


@pytest.mark.parametrize(("query", "update", "expected"), mongodb.UPSERTS, ids=short_id)
def test_upsert_inserts_documented_document(embedded, query, update, expected):
    if isinstance(expected, str):
        with pytest.raises(QueryError, match=re.escape(expected)):
            embedded.update(C, query, update, upsert=True)
        assert embedded.find(C) == []
        return
    assert embedded.update(C, query, update, upsert=True) == 1
    (found,) = embedded.find(C)
    assert next(iter(found)) == "_id"
    del found["_id"]
    assert is_identical(found, expected)


# --- refused operators ------------------------------------------------------------------------------------


def is_refused(name: str, operation: Any) -> bool:
    """Return whether an operation is refused with an error that contains the name."""
    try:
        operation()
    except QueryError as error:
        return name in str(error) and "needs MongoDB" in str(error)
    return False


@pytest.mark.parametrize("name", names.QUERY_OPERATORS)
def test_query_operator_has_cases_or_is_refused_by_name(embedded, name):
    if name in mongodb.QUERY_CASES:
        outcomes = {expected for _, _, expected in mongodb.QUERY_CASES[name]}
        assert True in outcomes
    else:
        assert is_refused(name, lambda: embedded.find(C, {"a": {name: 1}}))
        assert is_refused(name, lambda: embedded.find(C, {"a": {"$not": {name: 1}}}))


@pytest.mark.parametrize("name", names.TOP_QUERY_OPERATORS)
def test_top_level_operator_has_cases_or_is_refused_by_name(embedded, name):
    if name not in mongodb.QUERY_CASES:
        assert is_refused(name, lambda: embedded.find(C, {name: 1}))
        assert is_refused(name, lambda: embedded.watch(C, {name: 1}, print))


@pytest.mark.parametrize("name", names.UPDATE_OPERATORS)
def test_update_operator_has_cases_or_is_refused_by_name(embedded, name):
    if name in mongodb.UPDATE_CASES:
        assert any(not isinstance(expected, str) for *_, expected in mongodb.UPDATE_CASES[name])
    else:
        assert is_refused(name, lambda: embedded.update(C, {}, {name: {"a": 1}}))
        assert is_refused(name, lambda: embedded.update(C, {}, {"$push": {"a": {name: 1}}}))


@pytest.mark.parametrize("name", names.POSITIONAL_OPERATORS)
def test_positional_operator_is_refused_by_name(embedded, name):
    assert is_refused(name, lambda: embedded.update(C, {"a": 1}, {"$set": {f"a.{name}": 1}}))
    assert is_refused(name, lambda: embedded.update(C, {"a": 1}, {"$set": {f"a.{name}.b": 1}}))


@pytest.mark.parametrize("kind", names.INDEX_KINDS)
def test_special_index_is_refused_by_name(embedded, kind):
    assert is_refused(kind, lambda: embedded.create_index(C, {"a": kind}))
