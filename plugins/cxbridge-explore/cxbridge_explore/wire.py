"""The messages between the processes of an exploration: frames over a Unix socket, one for each process."""

from __future__ import annotations

import struct
from collections.abc import Iterator

from msgspec import Struct
from msgspec.msgpack import Decoder, Encoder

from cxbridge.process.forking import local_socket
from cxbridge_explore.graph import Leaf, Point
from cxbridge_explore.use import Used

_LENGTH = struct.Struct("!I")


class Hello(Struct, frozen=True, tag=True):
    """A process has started: it continues with an edge, or (None) it has loaded the scenario.

    :param pid: 0: it will be known when it says something else.
    """

    pid: int
    edge: tuple[int, int] | None = None


class Reached(Struct, frozen=True, tag=True):
    """The run has come to a choice point.

    :param digest: of its state; empty when the state cannot be compared.
    :param hidden: the reason of that.
    :param cpu_s: seconds of processor time that this process has used.
    :param used: the parts of the agent that the run has used since its last report.
    """

    point: Point
    digest: bytes
    hidden: str
    cpu_s: float
    used: tuple[Used, ...] = ()


class Ended(Struct, frozen=True, tag=True):
    """The run is over.

    :param cpu_s: seconds of processor time that this process has used.
    :param used: the parts of the agent that the run has used since its last report.
    """

    leaf: Leaf
    cpu_s: float
    used: tuple[Used, ...] = ()


class Refused(Struct, frozen=True, tag=True):
    """The scenario cannot be explored: it is wrong, or something is missing.

    :param text: the error, for people.
    """

    text: str


class Play(Struct, frozen=True, tag=True):
    """Begin a run that follows a path, and continues with an edge.

    :param choices: the choices of the path: index, subject, option.
    :param free: the number of the first choice point that is asked about.
    """

    edge: tuple[int, int]
    choices: tuple[tuple[int, str, str], ...]
    free: int


class Fork(Struct, frozen=True, tag=True):
    """Make a copy of the run that continues with an option."""

    edge: tuple[int, int]


class GoOn(Struct, frozen=True, tag=True):
    """Continue with an option."""

    option: int


class Leave(Struct, frozen=True, tag=True):
    """End: nothing is left to do here."""


Report = Hello | Reached | Ended | Refused
Order = Play | Fork | GoOn | Leave

_encoder = Encoder()
_reports: Decoder[Report] = Decoder(Report)
_orders: Decoder[Order] = Decoder(Order)


def frame(message: Report | Order) -> bytes:
    """Return a message as bytes."""
    data = _encoder.encode(message)
    return _LENGTH.pack(len(data)) + data


class Link:
    """A run's connection to who coordinates the exploration; blocks.

    :param address: the path of the coordinator's socket.
    """

    def __init__(self, address: str) -> None:
        self._socket = local_socket()
        self._socket.connect(address)

    def send(self, report: Report) -> None:
        """Say something."""
        self._socket.sendall(frame(report))

    def receive(self) -> Order:
        """Wait for an order.

        :raises EOFError: when the coordinator is gone.
        """
        (size,) = _LENGTH.unpack(self._exactly(_LENGTH.size))
        return _orders.decode(self._exactly(size))

    def _exactly(self, size: int) -> bytes:
        data = b""
        while len(data) < size:
            more = self._socket.recv(size - len(data))
            if not more:
                raise EOFError
            data += more
        return data

    def close(self) -> None:
        """Close it; another process may have it still."""
        self._socket.close()


class Reports:
    """Reads reports out of the bytes of a connection."""

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
