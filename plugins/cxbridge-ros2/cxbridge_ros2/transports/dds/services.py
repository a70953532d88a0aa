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
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from cyclonedds.core import Policy

from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import AnswerLater, Client, Failed, Receive
from cxbridge_ros2.transports.dds.domain import READ_QOS

if TYPE_CHECKING:
    from cyclonedds.builtin import DcpsEndpoint
    from cyclonedds.pub import DataWriter
    from cyclonedds.sub import DataReader

_HEADER: Final = struct.Struct("<Qq")  # client's id and the number of the request

_AGAIN_S: Final = 0.2  # seconds between two lookups of the server
_INTRODUCTION_S: Final = 2.0  # seconds for readers to find a writer

_CDR_HEADER: Final = 4  # bytes of the encapsulation header before the payload
_ID_BYTES: Final = 16  # bytes of a client's GUID

DecodeOrReport = Callable[[bytes], Message | None]
Encode = Callable[[Mapping[str, Any]], bytes]


def named(key: str) -> str:
    """Return the user data of the two endpoints of a client (``clientid``) or of a server (``serviceid``)."""
    return f"{key}={secrets.token_bytes(_ID_BYTES).hex('.')};"


class _Found:
    """The discovered endpoints with the ids of their owners."""

    def __init__(
        self, key: str, handles: Callable[[], list[int]], describe: Callable[[int], DcpsEndpoint | None]
    ) -> None:
        self._pattern = re.compile(rf"(?:^|;){key}=([^;]*);")
        self._handles, self._describe = handles, describe
        self._owners: dict[int, str] = {}

    @classmethod
    def readers(cls, key: str, writer: DataWriter[Any]) -> _Found:
        return cls(key, writer.get_matched_subscriptions, writer.get_matched_subscription_data)

    @classmethod
    def writers(cls, key: str, reader: DataReader[Any]) -> _Found:
        return cls(key, reader.get_matched_publications, reader.get_matched_publication_data)

    def now(self) -> Mapping[int, str]:
        """Return the owners of the discovered endpoints by handle; empty for an endpoint without an id."""
        known, self._owners = self._owners, {}
        for handle in matched(self._handles):
            owner = known.get(handle)
            if not owner:  # DDS may report the id later
                owner = self._owner(handle)
            if owner is not None:
                self._owners[handle] = owner
        return self._owners

    def has(self, owner: str) -> bool:
        """Return whether an owner has an endpoint now, or had one at the last look."""
        return owner in self._owners.values() or owner in self.now().values()

    def owner(self, handle: int) -> str:
        """Return the owner of an endpoint; empty if unknown."""
        return self._owners.get(handle) or self.now().get(handle, "")

    def _owner(self, handle: int) -> str | None:
        """Return the id in an endpoint's user data; None while DDS does not know the endpoint."""
        with READ_QOS:
            endpoint = self._describe(handle)
        if endpoint is None:
            return None
        policy = endpoint.qos[Policy.Userdata]
        owners = (
            None if policy is None else self._pattern.search(bytes(policy.data).decode("ascii", "replace"))
        )
        return "" if owners is None else owners[1]


class DdsClient(Client):
    """A client of a service.

    :param writer: writes requests.
    :param encode: encodes a request.
    :param decode: decodes a response, or reports a broken one.
    :param why: returns why there is no server.
    """

    def __init__(
        self,
        writer: DataWriter[Any],
        write: Callable[[bytes], None],
        encode: Encode,
        decode: DecodeOrReport,
        why: Callable[[], str],
    ) -> None:
        self._write, self._encode, self._decode, self._why = write, encode, decode, why
        self._requested = _Found.readers("serviceid", writer)
        self._introduction = _Introduction(writer)
        self._responded: _Found | None = None
        self._end: Callable[[], None] | None = None
        self._us = secrets.randbits(64)
        self._waiting: dict[int, tuple[Receive, Failed | None]] = {}
        self._number = 0
        self._unpaired_s = time.monotonic()

    def receive_from(self, reader: DataReader[Any], end: Callable[[], None]) -> None:
        """Receive responses from a reader; ``end`` closes it."""
        self._responded, self._end = _Found.writers("serviceid", reader), end

    def call(self, request: Mapping[str, Any], done: Receive, failed: Failed | None = None) -> int:
        payload = self._encode(request)
        self._number += 1
        self._waiting[self._number] = done, failed
        self._write(_with_header(payload, _HEADER.pack(self._us, self._number)))
        return self._number

    def forget(self, number: int) -> None:
        self._waiting.pop(number, None)

    def take(self, sample: Any) -> None:
        """Handle a response, which may be for another client."""
        data = sample.cdr
        if len(data) < _CDR_HEADER + _HEADER.size:
            return
        whose, number = _HEADER.unpack_from(data, _CDR_HEADER)
        callbacks = self._waiting.pop(number, None) if whose == self._us else None
        if callbacks is None:
            return
        done, failed = callbacks
        response = self._decode(_without_header(data))
        if response is not None:
            done(response)
        elif failed is not None:
            failed("the response is broken")

    @property
    def servers(self) -> frozenset[int]:
        """The servers with both ends found that have also found us."""
        if self._responded is None:
            return frozenset()  # the client is closed
        owners, requested = set(self._responded.now().values()), self._requested.now()
        paired = frozenset(handle for handle, owner in requested.items() if owner in owners)
        now_s = time.monotonic()
        if paired or not requested:
            self._unpaired_s = now_s
        elif owners and now_s - self._unpaired_s > _INTRODUCTION_S:
            paired = frozenset(requested)  # endpoints without ids cannot be paired
        return self._introduction.found(paired)

    def why_unserved(self) -> str:
        return self._why()

    def close(self) -> None:
        self._responded = None
        if self._end is not None:
            self._end()


class _Introduction:
    """Finds out which readers have found one of our writers.

    A reader that acknowledges a sample has found the writer. The writer sends the disposal of an instance,
    which readers of ROS skip because it is not a message.

    :param writer: a writer of messages without a key.
    """

    def __init__(self, writer: DataWriter[Any]) -> None:
        self._writer = writer
        self._asked: frozenset[int] = frozenset()
        self._found: frozenset[int] = frozenset()
        self._since_s = self._again_s = 0.0

    def found(self, handles: frozenset[int]) -> frozenset[int]:
        """Return the readers that have found the writer."""
        now_s = time.monotonic()
        if not handles <= self._asked:
            self._asked, self._since_s, self._again_s = handles, now_s, 0.0
        if handles <= self._found:
            return handles
        if now_s - self._again_s > _AGAIN_S:
            self._again_s = now_s
            self._writer.dispose(object.__new__(self._writer.data_type))
        # Give up after a while: a killed reader never acknowledges, and must not delay the live ones.
        if self._is_acknowledged() or now_s - self._since_s > _INTRODUCTION_S:
            self._found = self._asked
        return handles & self._found

    def _is_acknowledged(self) -> bool:
        try:
            return self._writer.wait_for_acks(0)
        except AttributeError:  # cyclonedds 11.0.1 raises this when the time is over
            return False


@dataclass(frozen=True, slots=True)
class _Response:
    """A response whose reader is not found yet."""

    data: bytes
    writer: int
    client: str


class DdsServer:
    """A server of a service.

    :param writer: writes responses.
    :param write: writes encoded responses.
    :param encode: encodes a response.
    :param decode: decodes a request, or reports a broken one.
    :param answer: answers requests.
    """

    def __init__(
        self,
        writer: DataWriter[Any],
        write: Callable[[bytes], None],
        encode: Encode,
        decode: DecodeOrReport,
        answer: AnswerLater,
    ) -> None:
        self._write, self._encode, self._decode, self._answer = write, encode, decode, answer
        self._readers = _Found.readers("clientid", writer)
        self._writers: _Found | None = None
        self._kept: list[_Response] = []

    def receive_from(self, reader: DataReader[Any]) -> None:
        self._writers = _Found.writers("clientid", reader)

    def close(self) -> None:
        """Send nothing more, not even pending responses."""
        self._kept, self._writers = [], None

    def take(self, sample: Any) -> None:
        head = sample.cdr[_CDR_HEADER : _CDR_HEADER + _HEADER.size]
        handle = _signed(sample.sample_info.publication_handle)
        client = "" if self._writers is None else self._writers.owner(handle)

        def reply(message: Mapping[str, Any]) -> None:
            if self._writers is None:
                return
            self._kept.append(_Response(_with_header(self._encode(message), head), handle, client))
            self.send()

        request = self._decode(_without_header(sample.cdr))
        if request is not None:
            self._answer(request, reply)

    def send(self) -> bool:
        """Send the responses whose readers are found; return whether some remain."""
        kept, self._kept = self._kept, []
        for each in kept:
            if not each.client or self._readers.has(each.client):
                self._write(each.data)
            elif self._writers is not None and each.writer in self._writers.now():
                self._kept.append(each)
        return bool(self._kept)


def matched(handles: Callable[[], list[int]]) -> list[int]:
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
