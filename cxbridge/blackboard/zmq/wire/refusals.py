"""Refusals of requests: the server's errors become replies, which become the same errors at the client.

An error for which there is no code becomes a :class:`RemoteRefusalError`.
"""

from __future__ import annotations

from typing import NoReturn

from cxbridge.blackboard.errors import (
    ForeignMessageError,
    InvalidInstanceError,
    InvalidNameError,
    NoWriterError,
    QueueFullError,
    UnknownTypeError,
    VersionMismatchError,
    WriterActiveError,
)
from cxbridge.blackboard.kit.errors import RemoteRefusalError, RequestTimeoutError
from cxbridge.blackboard.names import parse_uid
from cxbridge.blackboard.zmq.wire.frames import Reply, ResultCode
from cxbridge.errors import CxbridgeError


def raise_refusal(
    reply: Reply, *, uid: str, hash_: bytes = b"", message_type: str = "", serial: object = None
) -> NoReturn:
    """Raise the error that the server has encoded in a reply.

    :param uid: the interface of the request, ``Type::id``.
    :param hash_: the hash of the type in the client's request.
    :param message_type: the type of the message in the request.
    :param serial: the serial of the sending instance.
    :raises BlackBoardError: always, as the subclass that belongs to the code of the reply.
    """
    interface_type, interface_id = parse_uid(uid)
    match reply.code:
        case ResultCode.WRITER_ACTIVE:
            raise WriterActiveError(interface_type, interface_id, reply.text)
        case ResultCode.VERSION_MISMATCH:
            raise VersionMismatchError(uid, reply.hash, hash_)
        case ResultCode.UNKNOWN_TYPE:
            hint = f"the server reports: {reply.text}" if reply.text else None
            raise UnknownTypeError(interface_type, hint=hint)
        case ResultCode.INVALID_NAME:
            raise InvalidNameError(f"the server refuses the name {uid}")
        case ResultCode.NO_WRITER:
            raise NoWriterError(uid)
        case ResultCode.QUEUE_FULL:
            raise QueueFullError(uid, reply.detail)
        case ResultCode.INVALID_INSTANCE:
            raise InvalidInstanceError(uid, serial, "msgq_enqueue()")
        case ResultCode.UNKNOWN_MESSAGE:
            raise ForeignMessageError(message_type, interface_type)
        case ResultCode.TIMEOUT:
            raise RequestTimeoutError(f"the writer of {uid} did not accept the message in time")
        case _:
            raise RemoteRefusalError(reply.text or f"the server refuses the request: {reply.code.name}")


def make_refusal(error: CxbridgeError, request: int) -> Reply:  # noqa: PLR0911 - one return per error
    """Return the reply that refuses a request.

    :param request: the client's number of the request.
    """
    match error:
        case WriterActiveError():
            return Reply(ResultCode.WRITER_ACTIVE, text=error.owner, request=request)
        case VersionMismatchError():
            return Reply(ResultCode.VERSION_MISMATCH, hash=error.open_hash, request=request)
        case QueueFullError():
            return Reply(ResultCode.QUEUE_FULL, error.limit, request=request)
        case UnknownTypeError():
            return Reply(ResultCode.UNKNOWN_TYPE, text=error.hint or "", request=request)
        case InvalidNameError():
            return Reply(ResultCode.INVALID_NAME, request=request)
        case NoWriterError():
            return Reply(ResultCode.NO_WRITER, request=request)
    text = f"{error.message} ({error.hint})" if error.hint else error.message
    # the text may quote a name that has no UTF-8 form
    return Reply(ResultCode.REFUSED, text=text.encode(errors="replace").decode(), request=request)
