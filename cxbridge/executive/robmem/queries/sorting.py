"""The order of documents, and of an array's elements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cmp_to_key
from typing import Any

from cxbridge.executive.robmem.errors import QueryError
from cxbridge.executive.robmem.queries.conditions import whole_number
from cxbridge.executive.robmem.queries.paths import index_keys
from cxbridge.executive.robmem.values import MISSING, Document, Key, key

Order = Sequence[tuple[str, int]]
"""Paths, with 1 for ascending and -1 for descending."""

_MOST_PATHS = 32


def order_of(order: Mapping[str, Any], where: str = "sort") -> Order:
    """Return an order that was asked for.

    :param where: for the error: what has it.
    :raises QueryError: when it is none.
    """
    if not 0 < len(order) <= _MOST_PATHS:
        raise QueryError(f"{where}: an order takes 1 to {_MOST_PATHS} paths")
    result = []
    for path, direction in order.items():
        if path.startswith("$"):
            raise QueryError(f"{where}: there is no order '{path}' here", hint="see docs/robot-memory.md")
        if isinstance(direction, Mapping):
            raise QueryError(f"{where}: there is no '{next(iter(direction), '')}' for '{path}' here")
        number = whole_number(direction)
        if number not in (1, -1):
            raise QueryError(f"{where}: the direction of '{path}' is 1 or -1, not {direction!r}")
        if path and not all(path.split(".")):
            raise QueryError(f"{where}: '{path}' is not a path: a part of it is empty")
        result.append((path, number))
    return result


def sort_documents(documents: list[Document], order: Order) -> list[Document]:
    """Return documents sorted. Equals keep their order.

    :raises QueryError: when paths go through different arrays of a document.
    """
    paths = [path for path, _ in order]
    found = [(_first(index_keys(document, paths), order), document) for document in documents]
    return [document for _, document in _sorted(found, order)]


def sort_values(items: list[Any], order: Order, *, whole: bool) -> list[Any]:
    """Return an array's elements sorted, as ``$push`` does.

    :param whole: by themselves, not by fields of theirs; paths enter no arrays.
    """
    found = [(tuple(key(item if whole else _at(item, path)) for path, _ in order), item) for item in items]
    return [item for _, item in _sorted(found, order)]


def _at(item: Any, path: str) -> Any:
    for part in path.split("."):
        item = item.get(part, MISSING) if isinstance(item, dict) else MISSING
    return item


def _first(keys: list[tuple[Key, ...]], order: Order) -> tuple[Key, ...]:
    """Return the key by which a document with several stands: the first in the order."""
    if len(keys) == 1:
        return keys[0]

    def compare(one: tuple[Key, ...], other: tuple[Key, ...]) -> int:
        for mine, theirs, (_, direction) in zip(one, other, order, strict=True):
            if mine != theirs:
                return direction if mine > theirs else -direction
        return 0

    return min(keys, key=cmp_to_key(compare))


def _sorted(found: list[tuple[tuple[Key, ...], Any]], order: Order) -> list[tuple[tuple[Key, ...], Any]]:
    for number, (_, direction) in reversed(list(enumerate(order))):
        found = sorted(found, key=lambda each: each[0][number], reverse=direction == -1)
    return found
