"""Queries of the embedded store, compiled to functions.

Operators follow MongoDB's documentation. Unsupported operators are refused by name.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache
from typing import Any

from cxbridge.executive.robmem.errors import QueryError
from cxbridge.executive.robmem.values import EMPTY_ARRAY, MISSING, NAN, Document, Key, Regex, key

Test = Callable[[Any], bool]
"""A test of a value or a document."""

Order = list[tuple[str, int]]
"""Paths with 1 for ascending or -1 for descending."""

_COMPARISONS = {"$gt": operator.gt, "$gte": operator.ge, "$lt": operator.lt, "$lte": operator.le}
_FLAGS = {"i": re.IGNORECASE, "m": re.MULTILINE, "s": re.DOTALL, "x": re.VERBOSE}
# maximum number of steps of a match in the worst case; `re` takes a third of a second for them
_MOST_STEPS = 20_000_000

_TOKENS = re.compile(r"\\.|\[\^?\]?(?:\\.|[^\]\\])*\]|\)[*+{?]?|\(\?P=|\(\??|[*+{|?]")


def needs_mongodb(name: str) -> QueryError:
    """Return the error about an operation that the embedded store lacks."""
    return QueryError(
        f"{name} needs a MongoDB",
        hint="/cxbridge/robot-memory/backend: mongodb, with pip install 'cxbridge[mongodb]'; "
        "docs/evidence/robot-memory.md has the operators of the embedded store",
    )


def has_operators(wanted: Any) -> bool:
    """Return whether a document consists of operators. The first field decides."""
    return isinstance(wanted, Mapping) and next(iter(wanted), "").startswith("$")


def compile_query(query: Mapping[str, Any]) -> Test:
    """Return the test of a query.

    :raises QueryError: if the query is invalid or needs a MongoDB.
    """
    tests = [_part(name, wanted) for name, wanted in query.items()]
    if len(tests) == 1:
        return tests[0]
    return lambda document: all(test(document) for test in tests)


def _part(name: str, wanted: Any) -> Test:
    if name not in ("$and", "$or"):
        if name.startswith("$"):
            raise needs_mongodb(name)
        return _condition(name, wanted)
    if not isinstance(wanted, list) or not wanted or not all(isinstance(part, Mapping) for part in wanted):
        raise QueryError(f"{name} takes an array of queries, one at least")
    parts = [compile_query(part) for part in wanted]
    quantifier = all if name == "$and" else any
    return lambda document: quantifier(part(document) for part in parts)


def equalities(query: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield path and value of each required equality, for indexes and upserts.

    :param query: a query that has compiled before.
    """
    for name, wanted in query.items():
        if name == "$and" or (name == "$or" and len(wanted) == 1):
            for part in wanted:
                yield from equalities(part)
        elif name.startswith("$") or isinstance(wanted, Regex):
            continue
        elif not has_operators(wanted):
            yield name, wanted
        elif "$eq" in wanted:
            yield name, wanted["$eq"]
        elif len(wanted.get("$in", ())) == 1 and not isinstance(wanted["$in"][0], Regex):
            yield name, wanted["$in"][0]


def _condition(path: str, wanted: Any) -> Test:
    if not has_operators(wanted):
        return _any(path, compile_regex(wanted) if isinstance(wanted, Regex) else _equals(wanted))
    for name in wanted:
        if not name.startswith("$"):
            raise QueryError(f"'{name}' is among operators of '{path}'")
    parts = [
        _operator(path, name, operand, wanted)
        for name, operand in wanted.items()
        if not (name == "$options" and "$regex" in wanted)
    ]
    return parts[0] if len(parts) == 1 else lambda document: all(part(document) for part in parts)


def _any(path: str, test: Test) -> Test:
    read = leaves(path)
    return lambda document: any(map(test, read(document)))


def _not(condition: Test) -> Test:
    return lambda document: not condition(document)


def _operator(path: str, name: str, operand: Any, whole: Mapping[str, Any]) -> Test:
    if name in _VALUE_TESTS:
        return _any(path, _VALUE_TESTS[name](name, operand))
    match name:
        case "$ne" | "$nin":
            return _not(_any(path, _VALUE_TESTS["$eq" if name == "$ne" else "$in"](name, operand)))
        case "$exists":
            test = _any(path, lambda value: value is not MISSING)
            return test if operand else _not(test)
        case "$not":
            if not has_operators(operand) and not isinstance(operand, Regex):
                raise QueryError("$not takes operators or a regular expression")
            return _not(_condition(path, operand))
        case "$regex":
            return _any(path, compile_regex(_regex(operand, whole.get("$options", ""))))
    raise needs_mongodb(name)


def _equals(wanted: Any) -> Test:
    target = key(wanted)
    return lambda value: key(value) == target


def _equal_to(name: str, operand: Any) -> Test:
    if name == "$ne":
        _refuse_regex(name, operand)
    return _equals(operand)


def _refuse_regex(name: str, operand: Any) -> None:
    if isinstance(operand, Regex):
        raise QueryError(f"{name} takes no regular expression")


def _compares(name: str, operand: Any) -> Test:
    """Compare with a value. Only values of the same type match."""
    _refuse_regex(name, operand)
    target, holds = key(operand), _COMPARISONS[name]
    if target == NAN:
        return _equals(operand) if name in ("$gte", "$lte") else lambda _value: False
    return lambda value: (known := key(value))[0] == target[0] and holds(known, target)


def _member_of(name: str, operand: Any) -> Test:
    if not isinstance(operand, list) or any(map(has_operators, operand)):
        raise QueryError(f"{name} takes an array of values")
    patterns = [compile_regex(item) for item in operand if isinstance(item, Regex)]
    targets = {key(item) for item in operand if not isinstance(item, Regex)}
    return lambda value: key(value) in targets or any(pattern(value) for pattern in patterns)


_VALUE_TESTS: dict[str, Callable[[str, Any], Test]] = {
    "$eq": _equal_to,
    "$in": _member_of,
    **dict.fromkeys(_COMPARISONS, _compares),
}


def _regex(operand: Any, options: Any) -> Regex:
    if isinstance(operand, Regex):
        if operand.options and options:
            raise QueryError("options are in $regex or in $options, not in both")
        return Regex(operand.pattern, operand.options or options)
    if not isinstance(operand, str) or not isinstance(options, str):
        raise QueryError("a regular expression takes texts for $regex and $options")
    return Regex(operand, options)


def compile_regex(regex: Regex) -> Test:
    """Return a test that searches a text for a match, or finds the same regular expression.

    :raises QueryError: if the expression is invalid or needs a MongoDB. The test raises it for a text that is
        too long.
    """
    # Python's `re` has no time limit: expressions with exponential steps are refused, and texts that may
    # cause too many steps
    unknown = regex.options.strip("imsx")
    if unknown:
        raise QueryError(f"regular expressions have no option '{unknown[0]}'", hint="known are i, m, s and x")
    flags = sum(_FLAGS[letter] for letter in set(regex.options))
    try:
        compiled = re.compile(regex.pattern, flags)
    except (re.error, RecursionError, OverflowError) as error:
        raise QueryError(f"not a regular expression: {regex.pattern}: {error}") from None
    power, ways = _growth(regex)

    def test(value: Any) -> bool:
        if not isinstance(value, str):
            return bool(value == regex)
        if power and ways * (len(value) + 1) ** power > _MOST_STEPS:
            raise needs_mongodb(f"regular expression '{regex.pattern}' on {len(value)} characters")
        return compiled.search(value) is not None

    return test


def _growth(regex: Regex) -> tuple[int, int]:
    """Return exponent and factor of a match's steps in the worst case, by the length of the text."""
    # without an anchor, a match is attempted at each position
    power = int(not regex.pattern.startswith("^") or "m" in regex.options or "|" in regex.pattern)
    total, ways, depth, before = 0, 1, 0, ""
    for token in _TOKENS.findall(regex.pattern):
        if token[0] == ")":
            depth -= 1
            if token not in (")", ")?"):
                raise needs_mongodb(f"regular expression '{regex.pattern}' with a repeated group")
        if token == "|" and not depth:
            total, ways = total + ways, 1
        elif token in ("*", "+", "{", "(?P=") or re.fullmatch(r"\\[1-9]", token):
            power += 1
        elif token in ("|", ")?") or (token == "?" and before not in ("*", "+", "{")):
            ways *= 2
        depth += token[0] == "("
        before = token
    return power, total + ways


def array_index(part: str) -> int | None:
    """Return a path component as an array index; None if it is not an index."""
    if part.isascii() and part.isdigit() and (part == "0" or part[0] != "0"):
        return int(part)
    return None


@lru_cache(maxsize=256)
def leaves(path: str) -> Callable[[Any], Iterable[Any]]:
    """Return a reader of the values that a query compares: an array's elements and the array itself.

    The reader yields :data:`MISSING` for each path that ends early. An array without documents on the path
    yields nothing. An array named by index counts as one value.
    """
    if "." not in path:
        return lambda document: _expanded(document.get(path, MISSING))
    parts = path.split(".")
    return lambda document: _in_document(document, parts, 0)


def _expanded(value: Any) -> Iterable[Any]:
    return (*value, value) if isinstance(value, list) else (value,)


def _in_document(document: Document, parts: list[str], at: int) -> Iterator[Any]:
    value = document.get(parts[at], MISSING)
    at += 1
    if at == len(parts):
        yield from _expanded(value)
    elif isinstance(value, dict):
        yield from _in_document(value, parts, at)
    elif isinstance(value, list):
        yield from _in_array(value, parts, at)
    else:
        yield MISSING


def _in_array(items: list[Any], parts: list[str], at: int) -> Iterator[Any]:
    named = array_index(parts[at])
    for number, item in enumerate(items):
        if isinstance(item, dict):
            yield from _in_document(item, parts, at)
        if number != named:
            continue
        if at + 1 == len(parts):
            yield item
        elif isinstance(item, dict):
            yield from _in_document(item, parts, at + 1)
        elif isinstance(item, list):
            yield from _in_array(item, parts, at + 1)


def order_of(order: Mapping[str, Any], where: str = "sort") -> Order:
    """Check a requested order.

    :param where: the operation, for the error.
    :raises QueryError: if the order is invalid.
    """
    if not order:
        raise QueryError(f"{where} takes one path at least")
    for path, direction in order.items():
        if path.startswith("$") or isinstance(direction, str | Mapping):
            raise needs_mongodb(f"{where} '{path}': {direction!r}")
        if type(direction) not in (int, float) or direction not in (1, -1):
            raise QueryError(f"{where}: the direction of '{path}' is 1 or -1, not {direction!r}")
        if not all(path.split(".")):
            raise QueryError(f"{where}: '{path}' is not a path: a part of it is empty")
    return [(path, int(direction)) for path, direction in order.items()]


def sort_documents(documents: list[Document], order: Order) -> list[Document]:
    """Return documents in a stable order. An array sorts by its first element in that order.

    :raises QueryError: if several paths lead to arrays, which needs a MongoDB.
    """
    for path, direction in reversed(order):
        first = min if direction == 1 else max

        def place(document: Document, path: str = path, first: Callable[..., Key] = first) -> Key:
            keys = _sort_keys(document, path)
            if len(keys) > 1 and len(order) > 1:
                raise needs_mongodb(f"sorting by '{path}', an array, and other paths")
            return first(keys)

        documents = sorted(documents, key=place, reverse=direction == -1)
    return documents


def _sort_keys(document: Document, path: str) -> list[Key]:
    found = [*leaves(path)(document)]
    if found and isinstance(found[-1], list):  # the array follows its elements
        found.pop()
        return [*map(key, found)] or [EMPTY_ARRAY]
    return [*map(key, found)] or [key(None)]
