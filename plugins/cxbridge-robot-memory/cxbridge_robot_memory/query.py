"""Queries of the embedded store, compiled to functions.

Operators follow MongoDB's documentation. Unsupported operators, and paths with an index of an array, are
refused by name, before any document is read.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache, partial
from typing import Any

from cxbridge_robot_memory.errors import QueryError, mongodb_install_command
from cxbridge_robot_memory.values import MISSING, NAN_KEY, Document, Key, Regex, order_key

Matcher = Callable[[Any], bool]
"""A test of a value or a document, which a query is compiled to."""

Order = list[tuple[str, int]]
"""Paths, the most important path first, each with 1 for ascending or -1 for descending."""

_COMPARISONS = {"$gt": operator.gt, "$gte": operator.ge, "$lt": operator.lt, "$lte": operator.le}
_FLAGS = {"i": re.IGNORECASE, "m": re.MULTILINE, "s": re.DOTALL, "x": re.VERBOSE}

# the maximum number of steps of a match in the worst case, for which `re` takes a third of a second
_MAX_STEPS = 20_000_000

# the parts of a regular expression that decide how many steps a match takes; the pattern also matches whole
# escapes and sets, so that the characters in them do not count
_REGEX_TOKENS = re.compile(r"\\.|\[\^?\]?(?:\\.|[^\]\\])*\]|\)[*+{?]?|\(\?P=|\(\??|[*+{|?]")


def mongodb_needed_error(name: str) -> QueryError:
    """Return the error about an operation that the embedded store lacks.

    :param name: the operation, as the beginning of a sentence.
    """
    return QueryError(
        f"{name} needs MongoDB",
        hint=f"/cxbridge/robot-memory/backend: mongodb, with {mongodb_install_command()}; "
        "docs/evidence/robot-memory.md has the operators of the embedded store",
    )


def split_path(path: str) -> list[str]:
    """Return the names of the fields on a dotted path.

    :raises QueryError: for an index of an array, which needs MongoDB.
    """
    names = path.split(".")
    # the first name is always a field's
    if any(name.isdigit() for name in names[1:]):
        raise mongodb_needed_error(f"the index in the path '{path}'")
    return names


def has_operators(operand: Any) -> bool:
    """Return whether a document consists of operators. The first field decides."""
    return isinstance(operand, Mapping) and next(iter(operand), "").startswith("$")


def compile_query(query: Mapping[str, Any]) -> Matcher:
    """Return the matcher of a query.

    :raises QueryError: if the query is invalid or needs MongoDB.
    """
    return _conjunction_matcher([_field_matcher(name, operand) for name, operand in query.items()])


def _conjunction_matcher(matchers: list[Matcher]) -> Matcher:
    if len(matchers) == 1:
        return matchers[0]
    return lambda document: all(matches(document) for matches in matchers)


def _field_matcher(name: str, operand: Any) -> Matcher:
    """Return the matcher of a query's field: a condition for a path, or ``$and`` or ``$or`` with queries."""
    if name not in ("$and", "$or"):
        if name.startswith("$"):
            raise mongodb_needed_error(name)
        return _condition_matcher(name, operand)
    if (
        not isinstance(operand, list)
        or not operand
        or not all(isinstance(query, Mapping) for query in operand)
    ):
        raise QueryError(f"{name} must have an array of at least one query")
    matchers = [compile_query(query) for query in operand]
    if name == "$and":
        return _conjunction_matcher(matchers)
    return lambda document: any(matches(document) for matches in matchers)


def equalities(query: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield path and value of each equality that all matching documents fulfil, for indexes and upserts.

    :param query: a valid query: :func:`compile_query` has accepted it.
    """
    for name, operand in query.items():
        if name == "$and":
            for subquery in operand:
                yield from equalities(subquery)
        elif name == "$or" or isinstance(operand, Regex):
            continue
        elif not has_operators(operand):
            yield name, operand
        elif "$eq" in operand:
            yield name, operand["$eq"]


def _condition_matcher(path: str, operand: Any) -> Matcher:
    """Return the matcher of a field: equality with a value, or operators."""
    # a document without operators is a value, which must be equal as a whole
    if not has_operators(operand):
        return _path_matcher(
            path, compile_regex(operand) if isinstance(operand, Regex) else _equality_matcher(operand)
        )
    # $options belongs to $regex, which may come after it
    return _conjunction_matcher(
        [
            _operator_matcher(path, name, value, operand)
            for name, value in operand.items()
            if not (name == "$options" and "$regex" in operand)
        ]
    )


def _path_matcher(path: str, matches_value: Matcher) -> Matcher:
    """Return a matcher of documents whose value at a path matches; of an array, one element suffices."""
    read_values = leaf_reader(path)
    return lambda document: any(map(matches_value, read_values(document)))


def _negation_matcher(matches: Matcher) -> Matcher:
    return lambda document: not matches(document)


def _operator_matcher(path: str, name: str, operand: Any, operators: Mapping[str, Any]) -> Matcher:
    if name in _VALUE_MATCHERS:
        return _path_matcher(path, _VALUE_MATCHERS[name](name, operand))
    match name:
        case "$ne":
            _refuse_regex(name, operand)
            return _negation_matcher(_path_matcher(path, _equality_matcher(operand)))
        case "$nin":
            return _negation_matcher(_path_matcher(path, _membership_matcher(name, operand)))
        case "$not":
            if not has_operators(operand) and not isinstance(operand, Regex):
                raise QueryError("$not must have operators or a regular expression")
            return _negation_matcher(_condition_matcher(path, operand))
        case "$exists":
            exists = _path_matcher(path, lambda value: value is not MISSING)
            return exists if operand else _negation_matcher(exists)
        case "$regex":
            return _path_matcher(path, compile_regex(_make_regex(operand, operators.get("$options", ""))))
    raise mongodb_needed_error(name)


def _equality_matcher(operand: Any) -> Matcher:
    target = order_key(operand)
    return lambda value: order_key(value) == target


def _refuse_regex(name: str, operand: Any) -> None:
    if isinstance(operand, Regex):
        raise QueryError(f"{name} must not have a regular expression")


def _comparison_matcher(name: str, operand: Any) -> Matcher:
    """Return the matcher of a comparison. Only values of the operand's type match."""
    _refuse_regex(name, operand)
    target, compare = order_key(operand), _COMPARISONS[name]
    if target == NAN_KEY:  # NaN is neither less nor greater, and equal to itself here
        return _equality_matcher(operand) if name in ("$gte", "$lte") else lambda _value: False
    # a key begins with the position of its type
    return lambda value: (key := order_key(value))[0] == target[0] and compare(key, target)


def _membership_matcher(name: str, operand: Any) -> Matcher:
    if not isinstance(operand, list) or any(map(has_operators, operand)):
        raise QueryError(f"{name} must have an array of values")
    regex_matchers = [compile_regex(item) for item in operand if isinstance(item, Regex)]
    targets = {order_key(item) for item in operand if not isinstance(item, Regex)}
    return lambda value: order_key(value) in targets or any(matches(value) for matches in regex_matchers)


_VALUE_MATCHERS: dict[str, Callable[[str, Any], Matcher]] = {
    "$eq": lambda _name, operand: _equality_matcher(operand),
    "$in": _membership_matcher,
    **dict.fromkeys(_COMPARISONS, _comparison_matcher),
}


def _make_regex(operand: Any, options: Any) -> Regex:
    if isinstance(operand, Regex):
        return Regex(operand.pattern, operand.options or options)
    if not isinstance(operand, str) or not isinstance(options, str):
        raise QueryError("$regex and $options must be strings")
    return Regex(operand, options)


def compile_regex(regex: Regex) -> Matcher:
    """Return a matcher that searches a text for a match, or finds the same regular expression.

    Python's ``re`` has no time limit. Therefore an expression with exponential steps is refused, and so is a
    text on which the expression may take too many steps.

    :raises QueryError: if the expression is invalid or needs MongoDB. The matcher raises it for a text that
        is too long.
    """
    unknown_letters = regex.options.strip("imsx")
    if unknown_letters:
        raise QueryError(
            f"'{unknown_letters[0]}' is not an option of regular expressions", hint="use i, m, s and x"
        )
    flags = sum(_FLAGS[letter] for letter in set(regex.options))
    try:
        search = re.compile(regex.pattern, flags).search
    except (re.error, RecursionError, OverflowError) as error:
        raise QueryError(f"not a regular expression: {regex.pattern}: {error}") from None
    exponent, factor = _worst_case_cost(regex)

    def matches(value: Any) -> bool:
        if not isinstance(value, str):
            return bool(value == regex)
        if factor * (len(value) + 1) ** exponent > _MAX_STEPS:
            raise mongodb_needed_error(f"regular expression '{regex.pattern}' on {len(value)} characters")
        return search(value) is not None

    return matches


def _worst_case_cost(regex: Regex) -> tuple[int, int]:
    """Return exponent and factor of the maximum number of steps: ``factor * length ** exponent`` for a text.

    :raises QueryError: for a repeated group, whose steps may be exponential.
    """
    # without an anchor, a match is attempted at each position
    exponent = int(not regex.pattern.startswith("^") or "m" in regex.options or "|" in regex.pattern)
    # combination_count: the number of combinations of choices within an alternative of the whole expression
    alternatives_cost, combination_count, depth, previous_token = 0, 1, 0, ""
    for token in _REGEX_TOKENS.findall(regex.pattern):
        if token[0] == ")":
            depth -= 1
            if token not in (")", ")?"):
                raise mongodb_needed_error(f"regular expression '{regex.pattern}' with a repeated group")
        if token == "|" and not depth:
            # alternatives of the whole expression are tried in turn: their costs add up
            alternatives_cost, combination_count = alternatives_cost + combination_count, 1
        # a reference to a group may be as long as the text, like a repetition
        elif token in ("*", "+", "{", "(?P=") or re.fullmatch(r"\\[1-9]", token):
            exponent += 1
        # `?` after a repetition makes the repetition lazy, and adds no choice
        elif token in ("|", ")?") or (token == "?" and previous_token not in ("*", "+", "{")):
            combination_count *= 2
        depth += token[0] == "("
        previous_token = token
    return exponent, alternatives_cost + combination_count


@lru_cache(maxsize=256)  # rules repeat few paths, for each document that they search
def leaf_reader(path: str) -> Callable[[Document], Iterator[Any]]:
    """Return a reader of the values that a query compares: an array's elements and the array itself.

    The reader yields :data:`MISSING` for each path that ends early. An array without documents on the path
    yields nothing.
    """
    names = split_path(path)
    return lambda document: _values_at(document, names)


def _values_at(document: Document, names: list[str]) -> Iterator[Any]:
    name, *remaining = names
    value = document.get(name, MISSING)
    if not remaining:
        if isinstance(value, list):
            yield from value
        yield value
    elif isinstance(value, dict):
        yield from _values_at(value, remaining)
    elif isinstance(value, list):
        for item in value:
            if isinstance(item, dict):
                yield from _values_at(item, remaining)
    else:
        yield MISSING


def parse_order(order: Mapping[str, Any], operation: str = "sort") -> Order:
    """Return a requested order, checked.

    :param operation: the name of the operation, for the error.
    :raises QueryError: if the order is invalid or needs MongoDB.
    """
    if not order:
        raise QueryError(f"{operation} must have at least one path")
    for path, direction in order.items():
        if path.startswith("$") or isinstance(direction, str | Mapping):
            raise mongodb_needed_error(f"{operation} '{path}': {direction!r}")
        # type(): for isinstance(), True is an int
        if type(direction) not in (int, float) or direction not in (1, -1):
            raise QueryError(f"{operation}: the direction of '{path}' must be 1 or -1, not {direction!r}")
        if not all(split_path(path)):
            raise QueryError(f"{operation}: '{path}' is not a path, because a part of it is empty")
    return [(path, int(direction)) for path, direction in order.items()]


def sort_documents(documents: list[Document], order: Order) -> list[Document]:
    """Return documents sorted by the values at paths; documents with equal values keep their order.

    :raises QueryError: if a path leads to an array, which needs MongoDB.
    """
    for path, direction in reversed(order):  # stable sorts, the least important path first
        documents = sorted(
            documents, key=partial(sort_key, path=path, operation="sorting by"), reverse=direction == -1
        )
    return documents


def sort_key(document: Document, path: str, operation: str) -> Key:
    """Return the key of the single value at a path.

    :param operation: the name of the operation, for the error.
    :raises QueryError: if the path leads to an array, which needs MongoDB.
    """
    value: Any = document
    for name in split_path(path):
        value = value.get(name, MISSING) if isinstance(value, dict) else MISSING
        if isinstance(value, list):
            raise mongodb_needed_error(f"{operation} '{path}', an array,")
    return order_key(value)
