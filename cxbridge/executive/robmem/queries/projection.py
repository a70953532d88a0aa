"""Projections: which fields of documents ``$project`` shows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from cxbridge.executive.robmem.errors import QueryError
from cxbridge.executive.robmem.queries.conditions import has_operators
from cxbridge.executive.robmem.values import MISSING, NAN, NUMBERS, Document, key

_Tree = dict[str, Any]
"""Fields, each with the tree below it, or :data:`_END`."""

_END: _Tree = {}
"""Stands where a path ends."""


def compile_projection(wanted: Mapping[str, Any]) -> Callable[[Document], Document]:
    """Return what makes a document of the fields that are wanted, or of all but those that are not.

    :param wanted: paths with 1 or true, or with 0 or false; ``_id`` is shown unless it says otherwise.
    :raises QueryError: when it has both, or asks for values to be computed.
    """
    shown = dict(_flags(wanted, ""))
    if not shown:
        raise QueryError("$project takes one field at least")
    others = {value for path, value in shown.items() if path != "_id"} or {shown["_id"]}
    if len(others) > 1:
        raise QueryError("$project shows fields or hides them: only '_id' may differ from the other fields")
    including = others == {True}
    if including and not any(path.startswith("_id.") for path in shown):
        shown.setdefault("_id", True)
    tree = _tree([path for path, value in shown.items() if value == including])

    def project(document: Document) -> Document:
        return dict(_projected(document, tree, including=including))

    return project


def _flags(wanted: Mapping[str, Any], above: str) -> Iterator[tuple[str, bool]]:
    """Yield path and whether it is shown."""
    for name, value in wanted.items():
        path = f"{above}{name}"
        if not all(path.split(".")) or any(part.startswith("$") for part in path.split(".")):
            raise QueryError(f"$project: '{path}' is not a path of a field")
        if isinstance(value, Mapping) and value and not has_operators(value):
            yield from _flags(value, f"{path}.")
        elif isinstance(value, bool) or key(value)[0] in (NUMBERS, NAN[0]):
            yield path, key(value) not in (key(False), key(0))
        else:
            what = next(iter(value)) if has_operators(value) else repr(value)
            raise QueryError(
                f"$project: '{path}': there is no {what} here", hint="1 shows a field, 0 hides it"
            )


def _tree(paths: list[str]) -> _Tree:
    root: _Tree = {}
    for path in paths:
        at, parts = root, path.split(".")
        for part in parts[:-1]:
            at = at.setdefault(part, {})
            if at is _END:
                raise QueryError(f"$project: '{path}' is within another path")
        if at.setdefault(parts[-1], _END) is not _END:
            raise QueryError(f"$project: another path is within '{path}'")
    return root


def _projected(value: Any, tree: _Tree, *, including: bool) -> Any:
    """Return what is left of a value; missing when nothing is. Arrays are entered."""
    if isinstance(value, list):
        items = [_projected(item, tree, including=including) for item in value]
        return [item for item in items if item is not MISSING]
    if not isinstance(value, dict):
        return MISSING if including else value
    result = {}
    for name, item in value.items():
        below = tree.get(name)
        if below is None or below is _END:
            if (below is _END) == including:
                result[name] = item
            continue
        left = _projected(item, below, including=including)
        if left is not MISSING:
            result[name] = left
    return result
