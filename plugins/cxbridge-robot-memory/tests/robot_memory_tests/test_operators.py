"""The embedded store does what MongoDB documents of an operator, or refuses it by its name."""

from __future__ import annotations

import re
from typing import Any

import pytest

from cxbridge.clock import VirtualClock
from cxbridge_robot_memory.embedded import EmbeddedStore
from cxbridge_robot_memory.errors import QueryError
from cxbridge_robot_memory.update import Update
from cxbridge_robot_memory.values import copy, is_identical
from robot_memory_tests import mongodb_cases as mongodb
from robot_memory_tests import mongodb_names as names

C = "robmem.test"


def cases(table: dict[str, list[Any]]) -> list[Any]:
    """Return the rows of a table of operators, each behind its operator."""
    return [(name, *row) for name, rows in table.items() for row in rows]


def brief(value: object) -> str:
    return str(value)[:50]


@pytest.fixture
def embedded() -> EmbeddedStore:
    return EmbeddedStore(VirtualClock())


# --- as documented ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("_name", "document", "asked", "expected"), cases(mongodb.QUERY_CASES), ids=brief)
@pytest.mark.parametrize("others", [0, 40])
def test_a_query_finds_what_mongodb_documents(embedded, _name, document, asked, expected, others):
    for number in range(others):  # enough documents for a look-up of equal values
        embedded.insert(C, {"_id": number, "other": number})
    embedded.insert(C, {"_id": "it", **document})
    query = asked["query"] if isinstance(asked, dict) and "query" in asked else {"a": asked}
    found = [each["_id"] for each in embedded.find(C, query)]
    assert ("it" in found) is expected


@pytest.mark.parametrize(("query", "named"), mongodb.BAD_QUERIES, ids=brief)
def test_a_query_that_mongodb_refuses_is_refused(embedded, query, named):
    with pytest.raises(QueryError, match=re.escape(named)):
        embedded.find(C, query)  # also where nothing is


@pytest.mark.parametrize(("_name", "document", "update", "expected"), cases(mongodb.UPDATE_CASES), ids=brief)
def test_an_update_makes_what_mongodb_documents(_name, document, update, expected):
    before = {"_id": 1, **document}
    if isinstance(expected, str):
        with pytest.raises(QueryError, match=re.escape(expected)):
            Update(copy(update)).apply(copy(before), mongodb.NOW)
        return
    changed = Update(copy(update)).apply(copy(before), mongodb.NOW)
    # to the byte: types of numbers and the order of fields count
    if changed is None:
        assert is_identical(before, {"_id": 1, **expected})
    else:
        assert is_identical(changed, {"_id": 1, **expected})
        assert not is_identical(before, changed)


@pytest.mark.parametrize(("query", "update", "expected"), mongodb.UPSERTS, ids=brief)
def test_an_upsert_inserts_what_mongodb_documents(embedded, query, update, expected):
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


# --- or refused by name -----------------------------------------------------------------------------------


def refuses(name: str, operation: Any) -> bool:
    """Whether an operation is refused with an error that has this name in it."""
    try:
        operation()
    except QueryError as error:
        return name in str(error) and "needs MongoDB" in str(error)
    return False


@pytest.mark.parametrize("name", names.QUERY_OPERATORS)
def test_each_query_operator_of_the_manual_has_cases_or_is_refused_by_name(embedded, name):
    if name in mongodb.QUERY_CASES:
        fitting = {expected for _, _, expected in mongodb.QUERY_CASES[name]}
        assert True in fitting
    else:
        assert refuses(name, lambda: embedded.find(C, {"a": {name: 1}}))
        assert refuses(name, lambda: embedded.find(C, {"a": {"$not": {name: 1}}}))


@pytest.mark.parametrize("name", names.TOP_QUERY_OPERATORS)
def test_each_operator_beside_the_fields_has_cases_or_is_refused_by_name(embedded, name):
    if name not in mongodb.QUERY_CASES:
        assert refuses(name, lambda: embedded.find(C, {name: 1}))
        assert refuses(name, lambda: embedded.watch(C, {name: 1}, print))


@pytest.mark.parametrize("name", names.UPDATE_OPERATORS)
def test_each_update_operator_of_the_manual_has_cases_or_is_refused_by_name(embedded, name):
    if name in mongodb.UPDATE_CASES:
        assert any(not isinstance(expected, str) for *_, expected in mongodb.UPDATE_CASES[name])
    else:
        assert refuses(name, lambda: embedded.update(C, {}, {name: {"a": 1}}))
        assert refuses(name, lambda: embedded.update(C, {}, {"$push": {"a": {name: 1}}}))


@pytest.mark.parametrize("name", names.POSITIONAL_OPERATORS)
def test_positional_operators_are_refused_by_name(embedded, name):
    assert refuses(name, lambda: embedded.update(C, {"a": 1}, {"$set": {f"a.{name}": 1}}))
    assert refuses(name, lambda: embedded.update(C, {"a": 1}, {"$set": {f"a.{name}.b": 1}}))


@pytest.mark.parametrize("kind", names.INDEX_KINDS)
def test_each_kind_of_index_is_refused_by_name(embedded, kind):
    assert refuses(kind, lambda: embedded.create_index(C, {"a": kind}))
