"""Queries: compiled once, then asked of documents. What one field is asked is in `conditions`.

Each operator does what MongoDB documents, or is refused by its name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from bson import Regex

from cxbridge.executive.robmem.errors import QueryError
from cxbridge.executive.robmem.queries.conditions import Test, compile_condition, has_operators
from cxbridge.executive.robmem.values import Document

LOGICAL = ("$and", "$or", "$nor")


def compile_query(query: Mapping[str, Any]) -> Callable[[Document], bool]:
    """Return what says for a document whether it fits the query.

    :raises QueryError: when the query is not one.
    """
    tests = [_part(name, wanted) for name, wanted in query.items()]
    if len(tests) == 1:
        return tests[0]
    return lambda document: all(test(document) for test in tests)


def compile_elements(wanted: Any) -> Test:
    """Return what says for an array's element whether ``$elemMatch`` or ``$pull`` means it.

    :param wanted: operators for the element itself, or a query for elements that are documents.
    :raises QueryError: when it is neither.
    """
    if has_operators(wanted) and next(iter(wanted)) not in LOGICAL:
        return compile_condition(None, wanted, compile_elements)
    query = compile_query(wanted)

    def test(item: Any) -> bool:
        if isinstance(item, list):  # to MongoDB a document whose fields are numbers
            item = {str(number): each for number, each in enumerate(item)}
        return isinstance(item, dict) and query(item)

    return test


def _part(name: str, wanted: Any) -> Callable[[Document], bool]:
    if name in LOGICAL:
        return _several(name, wanted)
    if name.startswith("$"):
        if name == "$comment":
            return lambda _document: True
        raise QueryError(
            f"queries cannot have '{name}' here", hint=f"known are {', '.join(LOGICAL)}, $comment and fields"
        )
    return compile_condition(name, wanted, compile_elements)


def _several(name: str, wanted: Any) -> Callable[[Document], bool]:
    if not isinstance(wanted, list) or not wanted or not all(isinstance(part, Mapping) for part in wanted):
        raise QueryError(f"{name} takes an array of queries, one at least")
    parts = [compile_query(part) for part in wanted]
    if name == "$and":
        return lambda document: all(part(document) for part in parts)
    if name == "$or":
        return lambda document: any(part(document) for part in parts)
    return lambda document: not any(part(document) for part in parts)


def equalities(query: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield path and value of what the query wants equal in any case: for indexes and for upserts.

    :param query: one that was compiled before.
    """
    for name, wanted in query.items():
        if name == "$and" or (name == "$or" and len(wanted) == 1):
            for part in wanted:
                yield from equalities(part)
        elif name.startswith("$"):
            continue
        elif not has_operators(wanted):
            if not isinstance(wanted, Regex):
                yield name, wanted
        else:
            yield from ((name, value) for value in _equal_values(wanted))


def _equal_values(wanted: Mapping[str, Any]) -> Iterator[Any]:
    """Yield the values that operators want equal."""
    if "$eq" in wanted:
        yield wanted["$eq"]
    values = [*wanted.get("$all", ())]
    if len(wanted.get("$in", ())) == 1:
        values += wanted["$in"]
    for value in values:
        if not isinstance(value, Regex) and not has_operators(value):
            yield value
