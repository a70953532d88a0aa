"""Conversion of values to pymongo's package ``bson`` and back, and mongodump files."""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import UTC
from typing import Any

import bson
from bson.codec_options import CodecOptions

from cxbridge_robot_memory.errors import QueryError
from cxbridge_robot_memory.values import Document, ObjectId, Regex, Timestamp

# the times of documents have a zone, as in the embedded store
CODEC: CodecOptions[Document] = CodecOptions(tz_aware=True, tzinfo=UTC)
_OPTION_LETTERS = {re.IGNORECASE: "i", re.MULTILINE: "m", re.DOTALL: "s", re.VERBOSE: "x"}


def to_bson(value: Any) -> Any:
    """Return a document's value as a value for pymongo. Values of pymongo's own types are unchanged."""
    match value:
        case Mapping():
            return {name: to_bson(item) for name, item in value.items()}
        case list() | tuple():
            return [to_bson(item) for item in value]
        case ObjectId(digits=digits):
            return bson.ObjectId(digits)
        case Timestamp(time=time, inc=inc):
            return bson.Timestamp(time, inc)
        case Regex(pattern=pattern, options=options):
            return bson.Regex(pattern, options)
    return value


def from_bson(value: Any) -> Any:  # noqa: PLR0911 - one return for each type
    """Return a value of pymongo as a document's value. Types without a counterpart are unchanged."""
    match value:
        case dict():
            return {name: from_bson(item) for name, item in value.items()}
        case list():
            return [from_bson(item) for item in value]
        case bson.Int64():  # a subclass of int, whose type `order_key` does not know
            return int(value)
        case bson.ObjectId():
            return ObjectId(str(value))
        case bson.Timestamp():
            return Timestamp(value.time, value.inc)
        case bson.Regex():
            letters = "".join(letter for flag, letter in _OPTION_LETTERS.items() if value.flags & flag)
            return Regex(str(value.pattern), letters)
    return value


def encode_dump(documents: list[Document]) -> bytes:
    """Return documents in mongodump's format.

    :raises QueryError: if BSON cannot represent a document.
    """
    try:
        return b"".join(bson.encode(to_bson(document), codec_options=CODEC) for document in documents)
    except (bson.errors.BSONError, OverflowError, UnicodeError) as error:
        raise QueryError(f"not a document: {error}") from None


def decode_dump(dump: bytes) -> list[Document]:
    """Return the documents of a dump.

    :raises QueryError: if the bytes are not a dump.
    """
    try:
        return [from_bson(document) for document in bson.decode_all(dump, codec_options=CODEC)]
    except bson.errors.BSONError as error:
        raise QueryError(str(error)) from None
