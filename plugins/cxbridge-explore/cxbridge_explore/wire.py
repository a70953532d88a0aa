"""The messages between the processes of an exploration, as frames over a Unix socket.

Processes send reports to the coordinator, and the coordinator sends orders. A run that reaches a choice point
sends a :class:`ChoicePointReport`. If the state is new, the run gets a :class:`ForkOrder` for each option
except the last, and a :class:`ContinueOrder` for the last option. If the state is known, the run gets an
:class:`ExitOrder`.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from msgspec import Struct
from msgspec.msgpack import Decoder, Encoder

from cxbridge_explore.forking import make_local_socket
from cxbridge_explore.graph import Leaf, Point
from cxbridge_explore.use import UsedPart

_LENGTH_FORMAT = struct.Struct("!I")


class StartReport(Struct, frozen=True, tag=True):
    """A process has started, or the loader has loaded the scenario.

    A copy sends two such reports: its parent sends the first on the copy's connection before the fork.

    :param pid: the id of the process; 0 in the report before the fork.
    :param edge: the edge of a copy; None in reports of the loader.
    """

    pid: int
    edge: tuple[int, int] | None = None


class ChoicePointReport(Struct, frozen=True, tag=True):
    """The run has reached a choice point.

    :param digest: the digest of the state; empty if states are not compared.
    :param unmerged_reason: the reason for an empty digest.
    :param cpu_s: the processor time of this process.
    :param used_parts: the parts of the agent that were used for the first time since the last report.
    """

    point: Point
    digest: bytes
    unmerged_reason: str
    cpu_s: float
    used_parts: tuple[UsedPart, ...] = ()


class EndReport(Struct, frozen=True, tag=True):
    """The run has ended.

    :param cpu_s: the processor time of this process.
    :param used_parts: see :class:`ChoicePointReport`.
    """

    leaf: Leaf
    cpu_s: float
    used_parts: tuple[UsedPart, ...] = ()


class RefusalReport(Struct, frozen=True, tag=True):
    """The scenario cannot be explored.

    :param text: the error message.
    """

    text: str


class PlayOrder(Struct, frozen=True, tag=True):
    """Fork the loader for a run that follows a path to an edge.

    :param choices: the index, the subject and the option of each unusual choice.
    :param first_reported: the number of the first choice point that the run reports. At earlier points
        outside of the path, the run takes the usual option.
    """

    edge: tuple[int, int]
    choices: tuple[tuple[int, str, str], ...]
    first_reported: int


class ForkOrder(Struct, frozen=True, tag=True):
    """Fork the run for an option."""

    edge: tuple[int, int]


class ContinueOrder(Struct, frozen=True, tag=True):
    """Continue the run with an option."""

    option: int


class ExitOrder(Struct, frozen=True, tag=True):
    """Exit, since the state is known."""


Report = StartReport | ChoicePointReport | EndReport | RefusalReport
Order = PlayOrder | ForkOrder | ContinueOrder | ExitOrder

_encoder = Encoder()
_report_decoder: Decoder[Report] = Decoder(Report)
_order_decoder: Decoder[Order] = Decoder(Order)


def encode_frame(message: Report | Order) -> bytes:
    """Return a message as bytes after their count."""
    data = _encoder.encode(message)
    return _LENGTH_FORMAT.pack(len(data)) + data


class CoordinatorLink:
    """The blocking connection of a process to the coordinator.

    :param address: the path of the coordinator's socket.
    """

    def __init__(self, address: str) -> None:
        self._socket = make_local_socket()
        self._socket.connect(address)

    def send(self, report: Report) -> None:
        self._socket.sendall(encode_frame(report))

    def receive(self) -> Order:
        """Wait for an order.

        :raises EOFError: if the coordinator is gone.
        """
        (size,) = _LENGTH_FORMAT.unpack(self._receive_bytes(_LENGTH_FORMAT.size))
        return _order_decoder.decode(self._receive_bytes(size))

    def _receive_bytes(self, size: int) -> bytes:
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
        """Close this process's end of the connection; a copy may have the same connection open."""
        self._socket.close()


class ReportParser:
    """Parses the reports in the bytes of a connection, which arrive in pieces of any size."""

    def __init__(self) -> None:
        self._data = b""

    def feed(self, data: bytes) -> Iterator[Report]:
        """Add bytes, and yield the complete reports."""
        self._data += data
        while len(self._data) >= _LENGTH_FORMAT.size:
            end = _LENGTH_FORMAT.size + _LENGTH_FORMAT.unpack_from(self._data)[0]
            if len(self._data) < end:
                return
            report = _report_decoder.decode(self._data[_LENGTH_FORMAT.size : end])
            self._data = self._data[end:]
            yield report
