"""Services over DDS as in rmw_cyclonedds: a client id and a number precede each request and response.

DDS discovers writers and readers one by one on each side, and a message to a reader that has not found us is
lost. Therefore both sides name themselves in their user data, ``clientid`` and ``serviceid``. A client counts
a server as available only when it has found both ends of it and the server has found the writer of requests.
A server keeps a response until it has found the client's reader.
"""

from __future__ import annotations

import re
import secrets
import struct
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from cyclonedds.core import DDSException, Policy
from msgspec import Struct

from cxbridge.errors import Ros2Error
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import Client, FailureCallback, MessageCallback, RequestHandler
from cxbridge_ros2.transports.dds.domain import READ_QOS

if TYPE_CHECKING:
    from cyclonedds.builtin import DcpsEndpoint
    from cyclonedds.pub import DataWriter
    from cyclonedds.sub import DataReader

_HEADER: Final = struct.Struct("<Qq")  # client's id and the number of the request

_PROBE_S: Final = 0.2  # seconds between two probes of a reader
_INTRODUCTION_S: Final = 2.0  # seconds for readers to find a writer

_CDR_HEADER: Final = 4  # bytes of the encapsulation header before the payload
_ID_BYTES: Final = 16  # bytes of a client's GUID

Decode = Callable[[bytes], Message | None]  # decodes a message, or reports a broken message
Encode = Callable[[Mapping[str, Any]], bytes]


def owner_data(key: str) -> str:
    """Return the user data of both endpoints of a new client (``clientid``) or server (``serviceid``)."""
    return f"{key}={secrets.token_bytes(_ID_BYTES).hex('.')};"


class _EndpointOwners:
    """The owners of the discovered endpoints, by their user data.

    :param key: ``clientid`` or ``serviceid``.
    :param handles: returns the handles of the discovered endpoints.
    :param describe: returns an endpoint; None while DDS does not know the endpoint.
    """

    def __init__(
        self, key: str, handles: Callable[[], list[int]], describe: Callable[[int], DcpsEndpoint | None]
    ) -> None:
        self._pattern = re.compile(rf"(?:^|;){key}=([^;]*);")
        self._handles, self._describe = handles, describe
        self._owners: dict[int, str] = {}

    @classmethod
    def readers(cls, key: str, writer: DataWriter[Any]) -> _EndpointOwners:
        return cls(key, writer.get_matched_subscriptions, writer.get_matched_subscription_data)

    @classmethod
    def writers(cls, key: str, reader: DataReader[Any]) -> _EndpointOwners:
        return cls(key, reader.get_matched_publications, reader.get_matched_publication_data)

    def update(self) -> Mapping[int, str]:
        """Return the owners of the discovered endpoints by handle; empty for an endpoint without an id."""
        previous, self._owners = self._owners, {}
        for handle in matched_handles(self._handles):
            # an endpoint without an id is read again: DDS may report the id later
            owner = previous.get(handle) or self._read_owner(handle)
            if owner is not None:
                self._owners[handle] = owner
        return self._owners

    def has(self, owner: str) -> bool:
        """Return whether an owner has an endpoint now, or had one at the last update."""
        return owner in self._owners.values() or owner in self.update().values()

    def owner_of(self, handle: int) -> str:
        """Return the owner of an endpoint; empty if unknown."""
        return self._owners.get(handle) or self.update().get(handle, "")

    def _read_owner(self, handle: int) -> str | None:
        """Return the id in an endpoint's user data; None while DDS does not know the endpoint."""
        with READ_QOS:
            endpoint = self._describe(handle)
        if endpoint is None:
            return None
        policy = endpoint.qos[Policy.Userdata]
        text = "" if policy is None else bytes(policy.data).decode("ascii", "replace")
        match = self._pattern.search(text)
        return "" if match is None else match[1]


class DdsClient(Client):
    """A client of a service.

    :param writer: writes requests.
    :param encode: encodes a request.
    :param decode: decodes a response.
    :param describe_missing_server: returns why there is no server.
    """

    def __init__(
        self,
        writer: DataWriter[Any],
        encode: Encode,
        decode: Decode,
        missing_server_reason: Callable[[], str],
    ) -> None:
        super().__init__()
        self._writer, self._encode, self._decode = writer, encode, decode
        self._describe_missing_server = missing_server_reason
        self._request_readers = _EndpointOwners.readers("serviceid", writer)
        self._introduction = _Introduction(writer)
        self._response_writers: _EndpointOwners | None = None
        self._end: Callable[[], None] = lambda: None
        self._id = secrets.randbits(64)
        self._paired_s = time.monotonic()  # last time that each server had both ends, or none had an end

    def receive_from(self, reader: DataReader[Any], end: Callable[[], None]) -> None:
        """Receive responses from a reader; ``end`` closes reader and writer."""
        self._response_writers, self._end = _EndpointOwners.writers("serviceid", reader), end

    def call(
        self,
        request: Mapping[str, Any],
        on_response: MessageCallback,
        on_failure: FailureCallback | None = None,
    ) -> int:
        payload = self._encode(request)
        number = self._register_request(on_response, on_failure)
        write(self._writer, _with_header(payload, _HEADER.pack(self._id, number)))
        return number

    def take(self, sample: Any) -> None:
        """Handle a response, which may be for another client: all clients of a service share a topic."""
        data = sample.cdr
        if len(data) < _CDR_HEADER + _HEADER.size:
            return
        client_id, number = _HEADER.unpack_from(data, _CDR_HEADER)
        if client_id != self._id or number not in self._pending_callbacks:
            return
        on_response, on_failure = self._pending_callbacks.pop(number)
        response = self._decode(_without_header(data))
        if response is not None:
            on_response(response)
        elif on_failure is not None:
            on_failure("the response is broken")

    @property
    def server_numbers(self) -> frozenset[int]:
        """The servers with both ends found that have also found us."""
        if self._response_writers is None:
            return frozenset()  # the client is closed
        owners, readers = set(self._response_writers.update().values()), self._request_readers.update()
        paired = frozenset(handle for handle, owner in readers.items() if owner in owners)
        now_s = time.monotonic()
        if paired or not readers:
            self._paired_s = now_s
        elif owners and now_s - self._paired_s > _INTRODUCTION_S:
            paired = frozenset(readers)  # endpoints without ids cannot be paired
        return self._introduction.filter(paired)

    def missing_server_reason(self) -> str:
        return self._describe_missing_server()

    def close(self) -> None:
        self._response_writers = None
        self._end()


class _Introduction:
    """Finds out which readers have found a writer of ours.

    A reader that acknowledges a sample has found the writer. The writer sends the disposal of an instance,
    which readers of ROS skip because it is not a message.

    :param writer: a writer of messages without a key.
    """

    def __init__(self, writer: DataWriter[Any]) -> None:
        self._writer = writer
        self._probed: frozenset[int] = frozenset()
        self._introduced: frozenset[int] = frozenset()
        self._start_s = self._probe_s = 0.0

    def filter(self, handles: frozenset[int]) -> frozenset[int]:
        """Return those of some readers that have found the writer."""
        now_s = time.monotonic()
        if not handles <= self._probed:
            self._probed, self._start_s, self._probe_s = handles, now_s, 0.0
        if handles <= self._introduced:
            return handles
        if now_s - self._probe_s > _PROBE_S:
            self._probe_s = now_s
            self._writer.dispose(object.__new__(self._writer.data_type))
        # give up after a while: a killed reader never acknowledges, and must not delay the live ones
        if self._is_acknowledged() or now_s - self._start_s > _INTRODUCTION_S:
            self._introduced = self._probed
        return handles & self._introduced

    def _is_acknowledged(self) -> bool:
        try:
            return self._writer.wait_for_acks(0)
        except AttributeError:  # cyclonedds 11.0.1 raises this when the time is over
            return False


class _Response(Struct, frozen=True, eq=False):
    """A response whose reader is not found yet."""

    data: bytes
    request_writer: int
    client: str


class DdsServer:
    """A server of a service.

    :param writer: writes responses.
    :param encode: encodes a response.
    :param decode: decodes a request.
    """

    def __init__(
        self, writer: DataWriter[Any], encode: Encode, decode: Decode, handler: RequestHandler
    ) -> None:
        self._writer, self._encode, self._decode, self._handler = writer, encode, decode, handler
        self._response_readers = _EndpointOwners.readers("clientid", writer)
        self._request_writers: _EndpointOwners | None = None
        self._unsent: list[_Response] = []

    def receive_from(self, reader: DataReader[Any]) -> None:
        self._request_writers = _EndpointOwners.writers("clientid", reader)

    def close(self) -> None:
        """Send nothing more, not even pending responses."""
        self._unsent, self._request_writers = [], None

    def take(self, sample: Any) -> None:
        """Let the handler respond to a request."""
        header = sample.cdr[_CDR_HEADER : _CDR_HEADER + _HEADER.size]
        handle = _signed(sample.sample_info.publication_handle)
        client = "" if self._request_writers is None else self._request_writers.owner_of(handle)

        def reply(message: Mapping[str, Any]) -> None:
            if self._request_writers is None:
                return
            self._unsent.append(_Response(_with_header(self._encode(message), header), handle, client))
            self.send()

        request = self._decode(_without_header(sample.cdr))
        if request is not None:
            self._handler(request, reply)

    def send(self) -> bool:
        """Send the responses whose readers are found; return whether some remain."""
        responses, self._unsent = self._unsent, []
        for response in responses:
            if not response.client or self._response_readers.has(response.client):
                write(self._writer, response.data)
            # a response to a client that is gone is dropped
            elif (
                self._request_writers is not None
                and response.request_writer in self._request_writers.update()
            ):
                self._unsent.append(response)
        return bool(self._unsent)


def write(writer: DataWriter[Any], data: bytes) -> None:
    """Write a message as CDR with its four-byte header."""
    try:
        writer.write(sample_of(writer.data_type, data))
    except DDSException as error:
        raise Ros2Error(f"DDS does not take a message: {error}") from None


def sample_of(kind: Any, data: bytes, /, *_arguments: object, **_options: object) -> Any:
    """Return a sample with CDR bytes; the further arguments are those of cyclonedds' ``deserialize``."""
    sample = object.__new__(kind)
    sample.cdr = data
    return sample


def matched_handles(handles: Callable[[], list[int]]) -> list[int]:
    """Return the handles of the discovered endpoints.

    The wheel queries their number and then the handles, and fails if an endpoint appears in between.
    """
    while True:
        with suppress(IndexError):
            return handles()


def _signed(handle: int) -> int:
    """Convert an unsigned handle of a sample to the wheel's signed handles."""
    return handle - 2**64 if handle >= 2**63 else handle


def _with_header(data: bytes, header: bytes) -> bytes:
    return data[:_CDR_HEADER] + header + data[_CDR_HEADER:]


def _without_header(data: bytes) -> bytes:
    return data[:_CDR_HEADER] + data[_CDR_HEADER + _HEADER.size :]
