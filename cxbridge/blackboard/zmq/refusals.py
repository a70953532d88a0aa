"""Codes of the server to the errors that a local blackboard would have raised."""

from __future__ import annotations

from typing import NoReturn

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
from cxbridge.blackboard.names import parse_uid
from cxbridge.blackboard.zmq.codec import Code
from cxbridge.blackboard.zmq.dataframes import Frame
from cxbridge.blackboard.zmq.errors import RefusedError, RequestTimeoutError


def raise_refusal(
    reply: Frame, *, uid: str, hash_: bytes = b"", message_type: str = "", serial: object = None
) -> NoReturn:
    """Raise the error that a reply stands for.

    :param uid: of the interface that was asked for.
    :param hash_: of the type that was to be opened.
    :param message_type: of the message that was sent.
    :param serial: of the instance that sent it.
    """
    body = reply.body
    interface_type, interface_id = parse_uid(uid)
    match body.code:
        case Code.WRITER_ACTIVE:
            raise WriterActiveError(interface_type, interface_id, body.text)
        case Code.VERSION_MISMATCH:
            raise VersionMismatchError(uid, body.hash, hash_)
        case Code.UNKNOWN_TYPE:
            raise UnknownTypeError(interface_type, hint=f"at the server: {body.text}" if body.text else None)
        case Code.INVALID_NAME:
            raise InvalidNameError(f"the server refuses the name {uid}")
        case Code.NO_WRITER:
            raise NoWriterError(uid)
        case Code.QUEUE_FULL:
            raise QueueFullError(uid, body.detail)
        case Code.INVALID_INSTANCE:
            raise InvalidInstanceError(uid, serial, "msgq_enqueue()")
        case Code.UNKNOWN_MESSAGE:
            raise InvalidMessageError(message_type, interface_type)
        case Code.TIMEOUT:
            raise RequestTimeoutError(f"the writer of {uid} did not take the message in time")
        case _:
            raise RefusedError(body.text or f"the server refuses, code {body.code}")
