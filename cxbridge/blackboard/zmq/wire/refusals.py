"""Conversion of errors to codes on the wire and back."""

from __future__ import annotations

from typing import Any, NoReturn

from cxbridge.blackboard.errors import (
    InvalidInstanceError,
    InvalidMessageError,
    InvalidNameError,
    NoWriterError,
    QueueFullError,
    UnknownTypeError,
    VersionMismatchError,
    WriterActiveError,
)
from cxbridge.blackboard.kit.errors import RemoteRefusalError, RequestTimeoutError
from cxbridge.blackboard.names import parse_uid
from cxbridge.blackboard.zmq.wire.codec import ResultCode
from cxbridge.blackboard.zmq.wire.dataframes import ZmqFrame
from cxbridge.errors import CxbridgeError


def raise_refusal(
    reply: ZmqFrame, *, uid: str, hash_: bytes = b"", message_type: str = "", serial: object = None
) -> NoReturn:
    """Raise the error that a reply stands for.

    :param uid: the interface of the request.
    :param hash_: the type to be opened.
    :param serial: the sending instance.
    """
    body = reply.body
    interface_type, interface_id = parse_uid(uid)
    match body.code:
        case ResultCode.WRITER_ACTIVE:
            raise WriterActiveError(interface_type, interface_id, body.text)
        case ResultCode.VERSION_MISMATCH:
            raise VersionMismatchError(uid, body.hash, hash_)
        case ResultCode.UNKNOWN_TYPE:
            raise UnknownTypeError(interface_type, hint=f"at the server: {body.text}" if body.text else None)
        case ResultCode.INVALID_NAME:
            raise InvalidNameError(f"the server refuses the name {uid}")
        case ResultCode.NO_WRITER:
            raise NoWriterError(uid)
        case ResultCode.QUEUE_FULL:
            raise QueueFullError(uid, body.detail)
        case ResultCode.INVALID_INSTANCE:
            raise InvalidInstanceError(uid, serial, "msgq_enqueue()")
        case ResultCode.UNKNOWN_MESSAGE:
            raise InvalidMessageError(message_type, interface_type)
        case ResultCode.TIMEOUT:
            raise RequestTimeoutError(f"the writer of {uid} did not take the message in time")
        case _:
            raise RemoteRefusalError(body.text or f"the server refuses, code {body.code}")


def refusal_of(error: CxbridgeError) -> tuple[ResultCode, dict[str, Any]]:
    """Return the code and the fields of the reply that refuses a request."""
    if isinstance(error, WriterActiveError):
        return ResultCode.WRITER_ACTIVE, {"text": error.owner}
    if isinstance(error, VersionMismatchError):
        return ResultCode.VERSION_MISMATCH, {"hash": error.in_memory}
    if isinstance(error, QueueFullError):
        return ResultCode.QUEUE_FULL, {"detail": error.limit}
    for kind, code in (
        (UnknownTypeError, ResultCode.UNKNOWN_TYPE),
        (InvalidNameError, ResultCode.INVALID_NAME),
        (NoWriterError, ResultCode.NO_WRITER),
    ):
        if isinstance(error, kind):
            return code, {"text": error.hint or ""}
    return ResultCode.REFUSED, {"text": f"{error.message} ({error.hint})" if error.hint else error.message}
