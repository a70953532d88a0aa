"""The messages between the processes of an exploration, as frames over a Unix socket.

A process reports to the coordinator and obeys its orders. A run that reaches a choice point sends
:class:`Reached`, and then gets orders: :class:`Fork` for each option except the last option, and
:class:`Continue` for the last option; or :class:`Leave` if the state is known.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from msgspec import Struct
from msgspec.msgpack import Decoder, Encoder

from cxbridge_explore.forking import local_socket
from cxbridge_explore.graph import Leaf, Point
from cxbridge_explore.use import Used

_LENGTH = struct.Struct("!I")


class Hello(Struct, frozen=True, tag=True):
    """A process has started for an edge; without an edge, it has loaded the scenario.

    :param pid: the id of the process; 0 in the message that is sent before the fork.
    """

    pid: int
    edge: tuple[int, int] | None = None


class Reached(Struct, frozen=True, tag=True):
    """The run has reached a choice point.

    :param digest: the digest of the state; empty if states are not compared.
    :param unmerged_reason: the reason for an empty digest.
    :param cpu_s: the processor time of this process.
    :param used: the parts of the agent used since the last report.
    """

    point: Point
    digest: bytes
    unmerged_reason: str
    cpu_s: float
    used: tuple[Used, ...] = ()


class Ended(Struct, frozen=True, tag=True):
    """The run has ended.

    :param cpu_s: the processor time of this process.
    :param used: the parts of the agent used since the last report.
    """

    leaf: Leaf
    cpu_s: float
    used: tuple[Used, ...] = ()


class Refused(Struct, frozen=True, tag=True):
    """The scenario cannot be explored.

    :param text: the error message.
    """

    text: str


class Play(Struct, frozen=True, tag=True):
    """Start a run that follows a path to an edge.

    :param choices: the index, the subject and the option of each unusual choice.
    :param first_reported: the number of the first choice point to report; at earlier points outside of the
        path, the usual option is taken.
    """

    edge: tuple[int, int]
    choices: tuple[tuple[int, str, str], ...]
    first_reported: int


class Fork(Struct, frozen=True, tag=True):
    """Fork the run for an option."""

    edge: tuple[int, int]


class Continue(Struct, frozen=True, tag=True):
    """Continue the run with an option."""

    option: int


class Leave(Struct, frozen=True, tag=True):
    """Exit, since the state is known."""


Report = Hello | Reached | Ended | Refused
Order = Play | Fork | Continue | Leave

_encoder = Encoder()
_reports: Decoder[Report] = Decoder(Report)
_orders: Decoder[Order] = Decoder(Order)


def frame(message: Report | Order) -> bytes:
    """Return the bytes of a message, preceded by their number."""
    data = _encoder.encode(message)
    return _LENGTH.pack(len(data)) + data


class Link:
    """A run's blocking connection to the coordinator.

    :param address: the path of the coordinator's socket.
    """

    def __init__(self, address: str) -> None:
        self._socket = local_socket()
        self._socket.connect(address)

    def send(self, report: Report) -> None:
        self._socket.sendall(frame(report))

    def receive(self) -> Order:
        """Wait for an order.

        :raises EOFError: if the coordinator is gone.
        """
        (size,) = _LENGTH.unpack(self._exactly(_LENGTH.size))
        return _orders.decode(self._exactly(size))

    def _exactly(self, size: int) -> bytes:
        """Return the next ``size`` bytes, which may arrive in several pieces.

        :raises EOFError: if the coordinator is gone.
        """
        data = b""
        while len(data) < size:
            chunk = self._socket.recv(size - len(data))
            if not chunk:
                raise EOFError
            data += chunk
        return data

    def close(self) -> None:
        """Close this process's end of the connection."""
        self._socket.close()


class Reports:
    """Parser of reports from the bytes of a connection."""

    def __init__(self) -> None:
        self._data = b""

    def feed(self, data: bytes) -> Iterator[Report]:
        """Add bytes, and yield the complete reports."""
        self._data += data
        while len(self._data) >= _LENGTH.size:
            end = _LENGTH.size + _LENGTH.unpack_from(self._data)[0]
            if len(self._data) < end:
                return
            report = _reports.decode(self._data[_LENGTH.size : end])
            self._data = self._data[end:]
            yield report
