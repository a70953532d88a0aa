"""Services over DDS as in rmw_cyclonedds: the client's id and a number precede each request and response.

A client has a writer of requests and a reader of responses; a server has the counterparts. DDS discovers each
writer and reader separately, and a message to a reader that has not found the writer is lost. Therefore
clients and servers have an id in the user data of both their endpoints (``clientid``, ``serviceid``). To a
client, a server is present when the client has found both endpoints of the server, and the server's reader
has found the client's writer. A server keeps a response until it has found the client's reader.
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
from cxbridge_ros2.transports.dds.domain import QOS_LOCK

if TYPE_CHECKING:
    from cyclonedds.builtin import DcpsEndpoint
    from cyclonedds.pub import DataWriter
    from cyclonedds.sub import DataReader

_REQUEST_ID: Final = struct.Struct("<Qq")  # the id of the client, and the number of the request

_PROBE_PERIOD_S: Final = 0.2  # time between two probes of a reader, chosen freely
# Time after which a client no longer waits for a proof: a reader that acknowledges nothing counts as having
# found the writer, and readers whose ids match no writer of responses count as readers of servers.
_INTRODUCTION_TIMEOUT_S: Final = 2.0

_CDR_HEADER_BYTES: Final = 4  # the encapsulation header before the payload
_OWNER_ID_BYTES: Final = 16  # the length of a GUID, which rmw_cyclonedds writes here

Decode = Callable[[bytes], Message | None]  # decodes a message, or reports a broken message
Encode = Callable[[Mapping[str, Any]], bytes]


def make_owner_data(key: str) -> str:
    """Return user data with a new id, for both endpoints of a client or server.

    :param key: ``clientid`` or ``serviceid``.
    """
    return f"{key}={secrets.token_bytes(_OWNER_ID_BYTES).hex('.')};"


class _EndpointOwners:
    """The owners of discovered endpoints: the ids of clients or servers, from the user data of the endpoints.

    :param key: ``clientid`` or ``serviceid``.
    :param list_handles: returns the handles of the discovered endpoints.
    :param describe_endpoint: returns the endpoint of a handle; None while DDS does not know the endpoint.
    """

    def __init__(
        self,
        key: str,
        list_handles: Callable[[], list[int]],
        describe_endpoint: Callable[[int], DcpsEndpoint | None],
    ) -> None:
        self._pattern = re.compile(rf"(?:^|;){key}=([^;]*);")
        self._list_handles, self._describe_endpoint = list_handles, describe_endpoint
        self._owners: dict[int, str] = {}

    @classmethod
    def of_readers(cls, key: str, writer: DataWriter[Any]) -> _EndpointOwners:
        return cls(key, writer.get_matched_subscriptions, writer.get_matched_subscription_data)

    @classmethod
    def of_writers(cls, key: str, reader: DataReader[Any]) -> _EndpointOwners:
        return cls(key, reader.get_matched_publications, reader.get_matched_publication_data)

    def update(self) -> Mapping[int, str]:
        """Return the owners of the discovered endpoints by handle; the owner may be empty."""
        previous_owners, self._owners = self._owners, {}
        for handle in list_matched_handles(self._list_handles):
            # an endpoint without an id is read again: DDS may report the id later
            owner = previous_owners.get(handle) or self._read_owner(handle)
            if owner is not None:
                self._owners[handle] = owner
        return self._owners

    def has_endpoint(self, owner: str) -> bool:
        """Return whether an owner has an endpoint now, or had one at the last update."""
        return owner in self._owners.values() or owner in self.update().values()

    def find_owner(self, handle: int) -> str:
        """Return the owner of an endpoint; empty if unknown."""
        return self._owners.get(handle) or self.update().get(handle, "")

    def _read_owner(self, handle: int) -> str | None:
        """Return the id in an endpoint's user data, empty without an id.

        None means that DDS does not know the endpoint yet.
        """
        with QOS_LOCK:
            endpoint = self._describe_endpoint(handle)
        if endpoint is None:
            return None
        policy = endpoint.qos[Policy.Userdata]
        user_data = "" if policy is None else bytes(policy.data).decode("ascii", "replace")
        match = self._pattern.search(user_data)
        return "" if match is None else match[1]


class DdsClient(Client):
    """A client of a service.

    :param writer: writes requests.
    :param reader: receives responses, which its owner passes to :meth:`handle_sample`.
    :param encode: encodes a request.
    :param decode: decodes a response.
    :param describe_missing_server: returns why the service has no server.
    :param close_endpoints: closes the reader and the writer.
    """

    def __init__(
        self,
        writer: DataWriter[Any],
        reader: DataReader[Any],
        encode: Encode,
        decode: Decode,
        describe_missing_server: Callable[[], str],
        close_endpoints: Callable[[], None],
    ) -> None:
        super().__init__()
        self._writer, self._encode, self._decode = writer, encode, decode
        self._describe_missing_server, self._close_endpoints = describe_missing_server, close_endpoints
        self._request_readers = _EndpointOwners.of_readers("serviceid", writer)
        self._introduction_check = _IntroductionCheck(writer)
        self._response_writers: _EndpointOwners | None = _EndpointOwners.of_writers("serviceid", reader)
        self._id = secrets.randbits(64)
        # the last time that a server had both its endpoints, or that no reader of requests was found
        self._last_paired_s = time.monotonic()

    def call(
        self,
        request: Mapping[str, Any],
        on_response: MessageCallback,
        on_failure: FailureCallback | None = None,
    ) -> int:
        payload = self._encode(request)
        number = self._register_request(on_response, on_failure)
        write_data(self._writer, _insert_request_id(payload, _REQUEST_ID.pack(self._id, number)))
        return number

    def handle_sample(self, sample: Any) -> None:
        """Handle a response, perhaps to another client: the clients of a service share a topic."""
        encoded_response = sample.cdr
        if len(encoded_response) < _CDR_HEADER_BYTES + _REQUEST_ID.size:
            return
        client_id, number = _REQUEST_ID.unpack_from(encoded_response, _CDR_HEADER_BYTES)
        if client_id != self._id or number not in self._pending_callbacks:
            return
        on_response, on_failure = self._pending_callbacks.pop(number)
        response = self._decode(_remove_request_id(encoded_response))
        if response is not None:
            on_response(response)
        elif on_failure is not None:
            on_failure("the response is broken")

    @property
    def server_numbers(self) -> frozenset[int]:
        """The handles of the request readers of servers that are present, as the module says.

        A server whose presence cannot be proved counts as present after :data:`_INTRODUCTION_TIMEOUT_S`.
        """
        if self._response_writers is None:
            return frozenset()  # the client is closed
        owners, readers = set(self._response_writers.update().values()), self._request_readers.update()
        paired_handles = frozenset(handle for handle, owner in readers.items() if owner in owners)
        now_s = time.monotonic()
        if paired_handles or not readers:
            self._last_paired_s = now_s
        elif owners and now_s - self._last_paired_s > _INTRODUCTION_TIMEOUT_S:
            paired_handles = frozenset(readers)  # without ids in their user data, endpoints cannot be paired
        return self._introduction_check.filter_introduced(paired_handles)

    def explain_missing_server(self) -> str:
        return self._describe_missing_server()

    def close(self) -> None:
        self._response_writers = None
        self._close_endpoints()


class _IntroductionCheck:
    """Finds out which readers have found a writer.

    A reader that acknowledges a sample has found the writer. The sample is the disposal of an instance, which
    nodes of ROS skip, since it contains no message.

    :param writer: a writer of messages without a key.
    """

    def __init__(self, writer: DataWriter[Any]) -> None:
        self._writer = writer
        self._probed_handles: frozenset[int] = frozenset()
        self._introduced_handles: frozenset[int] = frozenset()
        self._start_s = self._last_probe_s = 0.0

    def filter_introduced(self, handles: frozenset[int]) -> frozenset[int]:
        """Return the handles of the readers that have found the writer, or had the time to find it.

        :param handles: the handles of readers.
        """
        now_s = time.monotonic()
        if not handles <= self._probed_handles:
            self._probed_handles, self._start_s, self._last_probe_s = handles, now_s, 0.0
        if handles <= self._introduced_handles:
            return handles
        if now_s - self._last_probe_s > _PROBE_PERIOD_S:
            self._last_probe_s = now_s
            # a sample without content, since the messages have no key that could identify the instance
            self._writer.dispose(object.__new__(self._writer.data_type))
        # give up after a while: a killed reader never acknowledges, and must not delay the live ones
        if self._is_acknowledged() or now_s - self._start_s > _INTRODUCTION_TIMEOUT_S:
            self._introduced_handles = self._probed_handles
        return handles & self._introduced_handles

    def _is_acknowledged(self) -> bool:
        try:
            return self._writer.wait_for_acks(0)
        except AttributeError:  # cyclonedds 11.0.1 raises this when the time is over
            return False


class _UnsentResponse(Struct, frozen=True, eq=False):
    """A response whose reader is not found yet.

    :param request_writer: the handle of the writer that has sent the request.
    :param client_id: the id of the client; empty if the client has no id.
    """

    encoded_response: bytes
    request_writer: int
    client_id: str


class DdsServer:
    """A server of a service.

    :param writer: writes responses.
    :param reader: receives requests, which its owner passes to :meth:`handle_sample`.
    :param encode: encodes a response.
    :param decode: decodes a request.
    """

    def __init__(
        self,
        writer: DataWriter[Any],
        reader: DataReader[Any],
        encode: Encode,
        decode: Decode,
        handler: RequestHandler,
    ) -> None:
        self._writer, self._encode, self._decode, self._handler = writer, encode, decode, handler
        self._response_readers = _EndpointOwners.of_readers("clientid", writer)
        self._request_writers: _EndpointOwners | None = _EndpointOwners.of_writers("clientid", reader)
        self._unsent_responses: list[_UnsentResponse] = []

    def close(self) -> None:
        """Drop all pending and later responses."""
        self._unsent_responses, self._request_writers = [], None

    def handle_sample(self, sample: Any) -> None:
        """Handle a request."""
        request_id = sample.cdr[_CDR_HEADER_BYTES : _CDR_HEADER_BYTES + _REQUEST_ID.size]
        handle = _to_signed(sample.sample_info.publication_handle)
        client_id = "" if self._request_writers is None else self._request_writers.find_owner(handle)

        def reply(message: Mapping[str, Any]) -> None:
            if self._request_writers is None:
                return
            self._unsent_responses.append(
                _UnsentResponse(_insert_request_id(self._encode(message), request_id), handle, client_id)
            )
            self.send_responses()

        request = self._decode(_remove_request_id(sample.cdr))
        if request is not None:
            self._handler(request, reply)

    def send_responses(self) -> bool:
        """Send the responses whose readers are found; return whether responses remain.

        A response to a client without an id is sent at once, since its reader cannot be recognised.
        """
        responses, self._unsent_responses = self._unsent_responses, []
        for response in responses:
            if not response.client_id or self._response_readers.has_endpoint(response.client_id):
                write_data(self._writer, response.encoded_response)
            # kept while the client has the writer of the request, dropped otherwise
            elif (
                self._request_writers is not None
                and response.request_writer in self._request_writers.update()
            ):
                self._unsent_responses.append(response)
        return bool(self._unsent_responses)


def write_data(writer: DataWriter[Any], encoded_message: bytes) -> None:
    """Write a message as CDR with its four-byte header.

    :raises Ros2Error: if DDS rejects the message.
    """
    try:
        writer.write(make_sample(writer.data_type, encoded_message))
    except DDSException as error:
        raise Ros2Error(f"DDS rejects a message: {error}") from None


def make_sample(sample_class: Any, encoded_message: bytes, /, *_arguments: object, **_options: object) -> Any:
    """Return a sample with CDR bytes; the remaining arguments are ignored.

    cyclonedds calls this function as the ``deserialize`` of a class, with its own arguments.
    """
    sample = object.__new__(sample_class)
    sample.cdr = encoded_message
    return sample


def list_matched_handles(list_handles: Callable[[], list[int]]) -> list[int]:
    """Return the handles of the discovered endpoints.

    cyclonedds queries the number of endpoints and then the handles. If an endpoint appears in between,
    cyclonedds raises an IndexError, and the query is repeated.
    """
    while True:
        with suppress(IndexError):
            return list_handles()


def _to_signed(handle: int) -> int:
    """Convert the unsigned 64-bit handle in a sample to a signed handle, as endpoints have."""
    return handle - 2**64 if handle >= 2**63 else handle


def _insert_request_id(encoded_message: bytes, request_id: bytes) -> bytes:
    return encoded_message[:_CDR_HEADER_BYTES] + request_id + encoded_message[_CDR_HEADER_BYTES:]


def _remove_request_id(encoded_message: bytes) -> bytes:
    return encoded_message[:_CDR_HEADER_BYTES] + encoded_message[_CDR_HEADER_BYTES + _REQUEST_ID.size :]
