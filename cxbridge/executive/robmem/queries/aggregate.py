"""Pipelines: ``$match $sort $limit $skip $project $count $facet``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cxbridge.executive.robmem.errors import QueryError
from cxbridge.executive.robmem.queries.conditions import whole_number
from cxbridge.executive.robmem.queries.projection import compile_projection
from cxbridge.executive.robmem.queries.query import compile_query
from cxbridge.executive.robmem.queries.sorting import order_of, sort_documents
from cxbridge.executive.robmem.values import Document


def aggregate(documents: Sequence[Document], pipeline: Any, *, within: str = "") -> list[Document]:
    """Send documents through a pipeline.

    :param within: the stage that this pipeline is a part of.
    :raises QueryError: when a stage is not one.
    """
    if not isinstance(pipeline, list):
        raise QueryError("a pipeline is an array of stages")
    result = list(documents)
    for stage in pipeline:
        if not isinstance(stage, Mapping) or len(stage) != 1:
            raise QueryError("a stage of a pipeline is a document with one operator")
        ((name, operand),) = stage.items()
        if name == within:
            raise QueryError(f"{name} cannot be within {within}")
        result = _stage(name, operand, result)
    return result


def _stage(name: str, operand: Any, documents: list[Document]) -> list[Document]:
    match name:
        case "$limit" | "$skip":
            number = whole_number(operand)
            if number is None or number < (name == "$limit"):
                raise QueryError(f"{name} takes a number of documents")
            return documents[:number] if name == "$limit" else documents[number:]
        case "$count":
            if not isinstance(operand, str) or not _is_field(operand):
                raise QueryError("$count takes the name of a field, without dollar, dot and NUL")
            return [{operand: len(documents)}] if documents else []
        case "$match" | "$sort" | "$project" | "$facet":
            if not isinstance(operand, Mapping):
                raise QueryError(f"{name} takes a document")
            return _stage_of_document(name, operand, documents)
    raise QueryError(f"there is no stage '{name}' here", hint="see docs/robot-memory.md")


def _stage_of_document(name: str, operand: Mapping[str, Any], documents: list[Document]) -> list[Document]:
    match name:
        case "$match":
            fits = compile_query(operand)
            return [document for document in documents if fits(document)]
        case "$sort":
            return sort_documents(documents, order_of(operand, "$sort"))
        case "$project":
            return list(map(compile_projection(operand), documents))
    if not operand or not all(map(_is_field, operand)):
        raise QueryError("$facet takes names of fields, without dollar, dot and NUL, each with a pipeline")
    return [{part: aggregate(documents, stages, within=name) for part, stages in operand.items()}]


def _is_field(name: str) -> bool:
    return bool(name) and not name.startswith("$") and "." not in name and "\0" not in name
