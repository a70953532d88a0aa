"""Listing and opening of interfaces on Fawkes' blackboard.

Fawkes opens an interface only with the hash of Fawkes' definition, which the client may not have. The client
offers the hashes of all definitions with the same layout.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from cxbridge.blackboard.base import OpenRequest, Registry
from cxbridge.blackboard.errors import (
    BlackBoardError,
    UnknownTypeError,
    VersionMismatchError,
    WriterActiveError,
)
from cxbridge.blackboard.info import InterfaceInfo
from cxbridge.blackboard.kit.errors import RemoteRefusalError
from cxbridge.blackboard.names import matches
from cxbridge_fawkes.network.client.port import anonymous_owners
from cxbridge_fawkes.network.client.requests import Reply, RequestSender
from cxbridge_fawkes.network.hashes import candidate_hashes, local_hash
from cxbridge_fawkes.network.messages.blackboard import Close, Open, OpenError, OpenFailure, OpenSuccess


def open_interface(
    requests: RequestSender, request: OpenRequest, on_opened: Callable[[OpenSuccess], None]
) -> OpenSuccess:
    """Offer hashes until the server accepts one; return the server's reply.

    :param on_opened: called in the receiving thread after opening, before the next frame is handled.
    :raises VersionMismatchError: if the server accepts none of the hashes.
    :raises RemoteRefusalError: if the interface has another size at the server, or the server refuses without
        a known reason.
    :raises UnknownTypeError: if the server does not know the type.
    :raises WriterActiveError: if the interface has a writer.
    :raises BlackBoardError: if the server does not reply, or after the shutdown.
    """
    schema = request.interface_class.SCHEMA

    def on_reply(reply: Reply) -> None:
        if isinstance(reply, OpenSuccess) and len(reply.block) == schema.datasize:
            on_opened(reply)

    candidates, listed_hashes, refused_hashes = candidate_hashes(schema), None, list[bytes]()
    # usually one round: the first candidate is Fawkes' own hash
    while True:
        offered_hash = candidates[0]
        reply = requests.request(Open(schema.name, request.id, offered_hash, request.is_writer), on_reply)
        if isinstance(reply, OpenSuccess):
            if len(reply.block) == schema.datasize:
                return reply
            requests.send(Close(reply.serial).to_bytes())
            raise RemoteRefusalError(
                f"{schema.name} has {len(reply.block)} bytes at the other end, "
                f"but {schema.datasize} bytes here",
                hint="both sides must use the same definition of the interface",
            )
        assert isinstance(reply, OpenFailure)
        if reply.error != OpenError.HASH_MISMATCH:
            raise _make_refusal_error(requests.address, reply.error, request)
        refused_hashes.append(offered_hash)
        # the server's list shows the server's hash if an interface of the type is open already
        if listed_hashes is None:
            listed_hashes = [info.hash for info in requests.list(schema.name, "*").interfaces]
            candidates = candidate_hashes(schema, listed_hashes)
        candidates = [candidate for candidate in candidates if candidate not in refused_hashes]
        if not candidates:
            raise VersionMismatchError(request.uid, next(iter(listed_hashes), b""), refused_hashes[0])


def list_interfaces(
    requests: RequestSender, registry: Registry, type_glob: str, id_glob: str
) -> Sequence[InterfaceInfo]:
    """Return the server's matching interfaces.

    :raises ConnectionLostError: if the server does not reply.
    :raises BlackBoardGoneError: after the shutdown.
    """
    return [
        InterfaceInfo(
            type=info.type,
            id=info.id,
            hash=local_hash(registry, info.type, info.hash),
            serial=info.number,
            has_writer=info.has_writer,
            writer="",
            readers=anonymous_owners(info.num_readers),
            timestamp_us=info.timestamp_us,
        )
        for info in requests.list(type_glob, id_glob).interfaces
        # again, because the server lists all interfaces if the patterns do not fit into the request
        if matches(info.type, info.id, type_glob, id_glob)
    ]


def _make_refusal_error(address: str, error_code: int, request: OpenRequest) -> BlackBoardError:
    interface_type, interface_id = request.key
    server_name = f"the Fawkes at {address}"
    if error_code == OpenError.UNKNOWN_TYPE:
        return UnknownTypeError(interface_type, hint=f"it is unknown to {server_name}")
    if error_code == OpenError.WRITER_EXISTS:
        return WriterActiveError(interface_type, interface_id, "")
    return RemoteRefusalError(f"{server_name} cannot open {request.uid}", hint="its log may say why")
