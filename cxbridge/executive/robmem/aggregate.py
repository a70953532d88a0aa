"""Pipelines: ``$match $sort $limit $skip $project $count $facet``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from cxbridge.executive.robmem.errors import QueryError
from cxbridge.executive.robmem.query import compile_query
from cxbridge.executive.robmem.values import Document, key, values_at


def sort_documents(documents: list[Document], order: Mapping[str, Any]) -> list[Document]:
    """Sort documents by several paths, 1 ascending and -1 descending. Equals keep their order.

    :raises QueryError: for another direction.
    """
    for path, direction in reversed(list(order.items())):
        if direction not in (1, -1):
            raise QueryError(f"the direction of '{path}' is 1 or -1, not {direction!r}")
        descending = direction == -1
        documents.sort(key=partial(_sort_key, path, descending=descending), reverse=descending)
    return documents


def _sort_key(path: str, document: Document, *, descending: bool) -> Any:
    keys = []
    for value in values_at(document, path):
        if isinstance(value, list):
            keys += [key(item) for item in value] or [(-1, 0)]
        else:
            keys.append(key(value))
    return (max if descending else min)(keys, default=key(None))


def aggregate(documents: Sequence[Document], pipeline: Sequence[Mapping[str, Any]]) -> list[Document]:
    """Send documents through a pipeline.

    :raises QueryError: when a stage is not one.
    """
    result = list(documents)
    for stage in pipeline:
        if not isinstance(stage, Mapping) or len(stage) != 1:
            raise QueryError("a stage of a pipeline is a document with one operator")
        ((name, operand),) = stage.items()
        result = _stage(name, operand, result)
    return result


def _stage(name: str, operand: Any, documents: list[Document]) -> list[Document]:
    if name in ("$limit", "$skip"):
        if isinstance(operand, bool) or not isinstance(operand, int) or operand < (name == "$limit"):
            raise QueryError(f"{name} takes a number of documents")
        return documents[:operand] if name == "$limit" else documents[operand:]
    if name == "$count":
        return [{str(operand): len(documents)}] if documents else []
    if not isinstance(operand, Mapping):
        raise QueryError(f"{name} takes a document")
    match name:
        case "$match":
            fits = compile_query(operand)
            return [document for document in documents if fits(document)]
        case "$sort":
            return sort_documents(list(documents), operand)
        case "$project":
            return [_project(document, operand) for document in documents]
        case "$facet":
            return [{part: aggregate(documents, pipeline) for part, pipeline in operand.items()}]
    raise QueryError(f"there is no stage '{name}' here", hint="see docs/robot-memory.md")


def _project(document: Document, wanted: Mapping[str, Any]) -> Document:
    shown = {path: bool(value) for path, value in wanted.items()}
    if any("." in path or isinstance(wanted[path], Mapping | str) for path in shown):
        raise QueryError("$project takes top-level fields with 1 or 0")
    if any(value for path, value in shown.items() if path != "_id"):
        return {
            name: value for name, value in document.items() if shown.get(name, name == "_id") is not False
        }
    return {name: value for name, value in document.items() if shown.get(name, True)}
