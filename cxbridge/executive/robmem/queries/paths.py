"""Paths with dots to values in documents, through arrays and their elements.

A query and an index enter arrays in ways of their own: see :func:`leaves` and :func:`index_keys`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache
from typing import Any

from bson import DBRef

from cxbridge.executive.robmem.errors import QueryError
from cxbridge.executive.robmem.values import EMPTY_ARRAY, MISSING, NULL, Document, Key, key

Reader = Callable[[Any], Iterable[Any]]
"""Returns the values at one place of what it is given."""


def array_index(part: str) -> int | None:
    """Return a part of a path as the index of an array's element; None when it is none."""
    if part.isascii() and part.isdigit() and (part == "0" or part[0] != "0"):
        return int(part)
    return None


@lru_cache(maxsize=256)
def leaves(path: str) -> Reader:
    """Return what reads the values that a query compares: an array's elements, and the array.

    :data:`MISSING` stands for each way that ends early; an array on the way that has no documents is no way.
    An array that the path names by its index is one value.
    """
    if "." not in path:
        return lambda document: _expanded(document.get(path, MISSING))
    parts = path.split(".")
    return lambda document: _in_document(document, parts, 0, expand=True)


def values(path: str) -> Reader:
    """Return what reads the values that a path leads to, an array as one: for ``$size``, ``$elemMatch``."""
    if "." not in path:
        return lambda document: (document.get(path, MISSING),)
    parts = path.split(".")
    return lambda document: _in_document(document, parts, 0, expand=False)


def _expanded(value: Any) -> Iterable[Any]:
    return (*value, value) if isinstance(value, list) else (value,)


def _in_document(document: Document, parts: list[str], at: int, *, expand: bool) -> Iterator[Any]:
    value = document.get(parts[at], MISSING)
    at += 1
    if at == len(parts):
        yield from _expanded(value) if expand else (value,)
    elif isinstance(value, dict):
        yield from _in_document(value, parts, at, expand=expand)
    elif isinstance(value, list):
        yield from _in_array(value, parts, at, expand=expand)
    elif isinstance(value, DBRef):
        yield from _in_document(value.as_doc(), parts, at, expand=expand)
    else:
        yield MISSING


def _in_array(items: list[Any], parts: list[str], at: int, *, expand: bool) -> Iterator[Any]:
    named = array_index(parts[at])
    for number, item in enumerate(items):
        if isinstance(item, dict):
            yield from _in_document(item, parts, at, expand=expand)
        if number != named:
            continue
        if at + 1 == len(parts):
            yield item
        elif isinstance(item, dict):
            yield from _in_document(item, parts, at + 1, expand=expand)
        elif isinstance(item, list):
            yield from _in_array(item, parts, at + 1, expand=expand)


# --- what indexes and sorting see -----------------------------------------------------------------------


def index_keys(document: Document, paths: Sequence[str]) -> list[tuple[Key, ...]]:
    """Return what an index on paths knows a document by: more than one when there is an array on the way.

    :raises QueryError: when two of the paths go through different arrays, or one has two meanings.
    """
    if len(paths) == 1 and "." not in paths[0]:
        value = document.get(paths[0], MISSING)
        if not isinstance(value, list):
            return [(key(value),)]
    return list(_index_keys([(document, path.split(".")) for path in paths]))


def _index_keys(places: list[tuple[Any, list[str]]]) -> Iterator[tuple[Key, ...]]:
    reached = [_reach(value, parts) for value, parts in places]
    array = next((value for value, _ in reached if isinstance(value, list)), None)
    if array is None:
        yield tuple(key(value) for value, _ in reached)
        return
    if any(isinstance(value, list) and value is not array for value, _ in reached):
        raise QueryError(
            "an index or an order cannot go through two arrays of one document (parallel arrays)"
        )
    fixed = [None if value is array else key(value) for value, _ in reached]
    if not array:
        yield tuple(
            known or (NULL if rest else EMPTY_ARRAY) for known, (_, rest) in zip(fixed, reached, strict=True)
        )
    for item in array:
        inner = [
            (item if isinstance(item, dict) else MISSING, rest)
            for known, (_, rest) in zip(fixed, reached, strict=True)
            if known is None and rest
        ]
        for keys in _index_keys(inner) if inner else [()]:
            following = iter(keys)
            yield tuple(
                known or (next(following) if rest else key(item))
                for known, (_, rest) in zip(fixed, reached, strict=True)
            )


def _reach(value: Any, parts: list[str]) -> tuple[Any, list[str]]:
    """Follow a path as far as there is one way; returns the value, or an array and the rest of the path."""
    for at, part in enumerate(parts):
        if isinstance(value, list):
            index = array_index(part)
            if index is None or index >= len(value):
                return value, parts[at:]
            if any(isinstance(item, dict) and part in item for item in value):
                raise QueryError(f"'{part}' is an index of an array and a field of its documents")
            value = value[index]
        else:
            value = value.get(part, MISSING) if isinstance(value, dict) else MISSING
    return value, []
