"""The messages between the processes of an exploration, over a Unix socket.

Processes send reports to the coordinator, and the coordinator sends orders. A run that reaches a choice point
sends a :class:`ChoicePointReport`. If the state is new, the run gets a :class:`ForkOrder` for each option
except the last, and a :class:`ContinueOrder` for the last option. If the state is known, the run gets an
:class:`ExitOrder`.
"""

from __future__ import annotations

from multiprocessing.connection import Connection

from msgspec import Struct
from msgspec.msgpack import Decoder, encode

from cxbridge_explore.forking import make_local_socket
from cxbridge_explore.graph import Edge, Leaf
from cxbridge_explore.used_parts import UsedPart
from cxbridge_explore.worlds.points import ChoicePoint, Step


class StartReport(Struct, frozen=True, tag=True):
    """A process has started, or the loader has loaded the scenario.

    The loader sends a report when it has started, and another when it has loaded the scenario. About a copy,
    two reports arrive on the copy's connection: one from its parent before the fork, one from the copy.

    :param pid: the id of the process; 0 in a report before the fork.
    :param edge: the edge of a copy; None in reports of the loader.
    """

    pid: int
    edge: Edge | None = None


class ChoicePointReport(Struct, frozen=True, tag=True):
    """The run has reached a choice point.

    :param digest: the digest of the state; empty if states are not compared.
    :param unmerged_reason: the reason for an empty digest.
    :param cpu_s: the processor time of this process.
    :param used_parts: the parts of the agent that were used for the first time since the last report.
    """

    point: ChoicePoint
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
    """The exploration cannot continue: the scenario is invalid, or a process cannot fork.

    :param text: the error message.
    """

    text: str


class PlayOrder(Struct, frozen=True, tag=True):
    """Fork the loader for a run that follows a path to an edge.

    :param path: the unusual choices of the run by the index of their point.
    :param first_reported_index: the index of the first choice point that the run reports. At earlier points
        outside of the path, the run takes the usual option.
    """

    edge: Edge
    path: dict[int, Step]
    first_reported_index: int


class ForkOrder(Struct, frozen=True, tag=True):
    """Fork the run for an option."""

    edge: Edge


class ContinueOrder(Struct, frozen=True, tag=True):
    """Continue the run with an option."""

    option: int


class ExitOrder(Struct, frozen=True, tag=True):
    """Exit, since the state is known."""


Report = StartReport | ChoicePointReport | EndReport | RefusalReport
Order = PlayOrder | ForkOrder | ContinueOrder | ExitOrder

_report_decoder: Decoder[Report] = Decoder(Report)
_order_decoder: Decoder[Order] = Decoder(Order)


def connect(address: str) -> Connection:
    """Open a connection to the coordinator.

    :param address: the path of the coordinator's socket.
    :raises OSError: if the coordinator is gone.
    """
    client_socket = make_local_socket()
    client_socket.connect(address)
    return Connection(client_socket.detach())


def send(connection: Connection, message: Report | Order) -> None:
    """Send a message.

    :raises OSError: if the receiver is gone.
    """
    connection.send_bytes(encode(message))


def receive_report(connection: Connection) -> Report:
    """Wait for a report of a process.

    :raises EOFError: if the process is gone.
    :raises OSError: if the connection is broken.
    """
    return _report_decoder.decode(connection.recv_bytes())


def receive_order(connection: Connection) -> Order:
    """Wait for an order of the coordinator; the errors are those of :func:`receive_report`."""
    return _order_decoder.decode(connection.recv_bytes())
