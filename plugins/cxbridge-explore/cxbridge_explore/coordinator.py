"""Coordinates the processes of an exploration: owns the graph, and resumes or forks runs.

The loader is a process that loads the scenario once. The coordinator orders the loader to fork a copy for a
path, and orders a run that waits at a choice point to fork a copy for each option. The exploration is
depth-first: the run that reached its choice point last continues first, so that few runs wait. If a process
dies, its edge stays open, and another process replays the path to the edge. An edge on which processes die
again and again counts as crashed.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
import time
from collections.abc import Callable
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Final

from cxbridge.closing import Closing
from cxbridge.errors import CxbridgeError
from cxbridge_explore import forking
from cxbridge_explore.bounds import ExecutionOptions
from cxbridge_explore.graph import BAD_INPUT, DIVERGED, Edge, Graph, Leaf
from cxbridge_explore.wire import (
    ChoicePointReport,
    ContinueOrder,
    EndReport,
    ExitOrder,
    ForkOrder,
    Order,
    PlayOrder,
    RefusalReport,
    Report,
    StartReport,
    receive_report,
    send,
)
from cxbridge_explore.worlds.points import DivergedError

# These numbers are chosen freely.
_POLL_S: Final = 0.25  # seconds between two checks of the processes
_MAX_DEATHS: Final = 3  # number of deaths of processes after which an edge counts as crashed
_MAX_WAITING_CONNECTIONS: Final = 128  # not accepted yet; the process of a further connection waits


class _Peer:
    """A process of the exploration.

    :ivar pid: the id of the process; 0 until the process has reported its id.
    :ivar edge: the open edge of its run; None while the run waits, and for the loader.
    :ivar option_edges: the unexplored edges of the choice point at which its run waits, the usual edge first.
    :ivar ordered_edges: the edges of ordered copies that have not reported yet.
    :ivar reported_cpu_s: the processor time that the process has reported.
    :ivar departure_s: the real time when the run left its last choice point.
    :ivar departure_cpu_s: the processor time of the process at that moment.
    """

    def __init__(self, connection: Connection) -> None:
        self.connection = connection
        self.pid = 0
        self.edge: Edge | None = None
        self.option_edges: list[Edge] = []
        self.ordered_edges: list[Edge] = []
        self.reported_cpu_s = 0.0
        self.departure_s = time.monotonic()
        self.departure_cpu_s = 0.0

    def put_on_edge(self, edge: Edge) -> None:
        """Put the run of the process on an edge."""
        self.edge = edge
        self.restart_measurement()

    def take_off_edge(self) -> Edge:
        """Take the run of the process off its edge, and return the edge.

        :raises ValueError: if the run is on no edge.
        """
        edge, self.edge = self.edge, None
        if edge is None:
            raise ValueError("a process without an edge has sent a report about its run")
        return edge

    def restart_measurement(self) -> None:
        """Restart the measurement of the time since the run's last choice point."""
        self.departure_s, self.departure_cpu_s = time.monotonic(), forking.read_cpu_seconds(self.pid)

    def send(self, order: Order) -> None:
        """Send an order. A failure is ignored, since the end of the connection reveals a dead process."""
        with contextlib.suppress(OSError):
            send(self.connection, order)


class Coordinator(Closing):
    """Explores with processes until no edge is open. A context manager.

    :param graph: the known graph, whose open edges are explored.
    :param run_loader: runs in the loader's process; called with the address of the coordinator's socket.
    :ivar cpu_seconds: the processor time of all copies, without this process and the loader.
    """

    def __init__(
        self, graph: Graph, execution: ExecutionOptions, run_loader: Callable[[str], object]
    ) -> None:
        self.graph = graph
        self.cpu_seconds = 0.0
        self._execution, self._run_loader = execution, run_loader
        self._folder = tempfile.TemporaryDirectory(prefix="cxbridge-explore-")
        self._address = str(Path(self._folder.name) / "socket")
        self._listening_socket = forking.make_local_socket()
        self._listening_socket.bind(self._address)
        self._listening_socket.listen(_MAX_WAITING_CONNECTIONS)
        self._peers: dict[Connection, _Peer] = {}
        self._waiting_peers: list[_Peer] = []  # whose runs are at choice points with unexplored options
        self._pending_edges: list[Edge] = list(graph.open_edges)[::-1]  # without a process; the last is next
        self._death_counts: dict[Edge, int] = {}
        self._loader: _Peer | None = None
        self._loader_pid = 0
        self._is_loaded = False
        self._loader_death_count = 0

    # ---- main loop

    def explore(self, is_over: Callable[[], bool]) -> None:
        """Explore until no edge is open or ``is_over`` returns True.

        :raises CxbridgeError: if the scenario is invalid, or its process does not load it.
        :raises DivergedError: if a run differs from an earlier run on the same path.
        """
        self._start_loader()
        while self.graph.open_edges and not is_over():
            self._schedule()
            for source in wait([self._listening_socket, *self._peers], _POLL_S):
                if isinstance(source, Connection):
                    self._receive_report(self._peers[source])
                else:
                    self._accept_connection()
            self._kill_endless_runs()
            self._restart_loader()

    def _start_loader(self) -> None:
        self._is_loaded = False
        pid = forking.fork()
        if not pid:
            self._listening_socket.close()
            self._run_loader(self._address)  # ends the process
            os._exit(1)  # otherwise, the copy would return into the loop of the coordinator
        self._loader_pid = pid

    def _accept_connection(self) -> None:
        accepted_socket, _ = self._listening_socket.accept()
        connection = Connection(accepted_socket.detach())
        self._peers[connection] = _Peer(connection)

    # ---- active runs

    def _schedule(self) -> None:
        """Continue or start as many runs as the limit allows."""
        # the runs that are playing, and the ordered copies
        active_count = sum((peer.edge is not None) + len(peer.ordered_edges) for peer in self._peers.values())
        for _ in range(self._execution.process_count - active_count):
            if self._waiting_peers:  # the latest first, so that few runs wait
                self._continue_run(self._waiting_peers[-1])
            elif self._pending_edges and self._is_loaded and self._loader is not None:
                self._start_run(self._loader, self._pending_edges.pop())
            else:
                return

    def _continue_run(self, peer: _Peer) -> None:
        """Fork a waiting run for its next option; the run takes its last option itself."""
        edge = peer.option_edges.pop()
        if peer.option_edges:
            self._order_copy(peer, edge, ForkOrder(edge))
            return
        self._waiting_peers.remove(peer)
        peer.put_on_edge(edge)
        _, option = edge
        peer.send(ContinueOrder(option))

    def _start_run(self, loader: _Peer, edge: Edge) -> None:
        """Order the loader to fork a run that follows the path to an edge."""
        order = PlayOrder(edge, dict(self.graph.find_path(edge)), self.graph.next_point_index(edge))
        self._order_copy(loader, edge, order)

    @staticmethod
    def _order_copy(peer: _Peer, edge: Edge, order: Order) -> None:
        """Order a process to fork for an edge."""
        peer.ordered_edges.append(edge)
        peer.send(order)

    # ---- reports

    def _receive_report(self, peer: _Peer) -> None:
        try:
            report = receive_report(peer.connection)
        except (EOFError, OSError):
            self._handle_death(peer)
        else:
            self._handle_report(peer, report)

    def _handle_report(self, peer: _Peer, report: Report) -> None:
        match report:
            case StartReport():
                self._handle_start(peer, report)
            case ChoicePointReport():
                self._handle_choice_point(peer, report)
            case EndReport():
                peer.reported_cpu_s = report.cpu_s
                self.graph.used_parts.update(report.used_parts)
                if report.leaf.outcome == BAD_INPUT:
                    raise CxbridgeError(report.leaf.reason)
                if report.leaf.outcome == DIVERGED:
                    raise DivergedError(report.leaf.reason)
                self.graph.record_end(peer.take_off_edge(), report.leaf)
            case RefusalReport():
                raise CxbridgeError(report.text)

    def _handle_start(self, peer: _Peer, report: StartReport) -> None:
        if report.edge is None:
            # the loader reports twice: before and after it loads the scenario
            self._is_loaded = self._loader is peer
            self._loader, peer.pid = peer, report.pid
        elif report.pid:
            peer.pid = report.pid
            peer.restart_measurement()
        else:  # The parent opens the connection for its copy before the fork; the copy reports its id later.
            parent = next(
                (other for other in self._peers.values() if report.edge in other.ordered_edges), None
            )
            if parent is None:
                self._disconnect(peer)  # the parent died before the fork, and its edge is pending again
            else:
                parent.ordered_edges.remove(report.edge)
                peer.put_on_edge(report.edge)

    def _handle_choice_point(self, peer: _Peer, report: ChoicePointReport) -> None:
        peer.reported_cpu_s = report.cpu_s
        self.graph.used_parts.update(report.used_parts)
        number = self.graph.record_choice_point(
            peer.take_off_edge(), report.point, report.digest, report.unmerged_reason
        )
        if number is None:
            peer.send(ExitOrder())
            return
        peer.option_edges = [(number, option) for option in self.graph.allowed_options(number)]
        self._waiting_peers.append(peer)
        # a run with one option continues at once: it was active until now, so the limit allows it
        if len(peer.option_edges) == 1:
            self._continue_run(peer)

    # ---- dead processes

    def _disconnect(self, peer: _Peer) -> None:
        """Close the connection of a process, which then ends."""
        peer.connection.close()
        del self._peers[peer.connection]
        self.cpu_seconds += peer.reported_cpu_s

    def _handle_death(self, peer: _Peer) -> None:
        """Reopen the edges of a process that has died."""
        self._disconnect(peer)
        if peer in self._waiting_peers:
            self._waiting_peers.remove(peer)
        if peer is self._loader:
            self._loader, self._is_loaded = None, False
        self._pending_edges += [*peer.option_edges, *peer.ordered_edges]
        if peer.edge is not None:
            self._retry(peer.edge)

    def _retry(self, edge: Edge) -> None:
        """Explore an edge again after the death of its process, up to a number of deaths."""
        self._death_counts[edge] = self._death_counts.get(edge, 0) + 1
        if self._death_counts[edge] < _MAX_DEATHS:
            self._pending_edges.append(edge)
        else:
            reason = f"its process ended {_MAX_DEATHS} times without a report"
            self.graph.record_end(edge, Leaf("crashed", reason, seconds=0.0, is_given_up=True))

    def _restart_loader(self) -> None:
        """Restart a loader that has died."""
        if not forking.has_ended(self._loader_pid):
            return
        self._loader_pid = 0
        self._loader_death_count += 1
        if self._loader_death_count >= _MAX_DEATHS and not self.graph.nodes and not self.graph.leaves:
            raise CxbridgeError("the process that loads the scenario ends each time without a report")
        self._start_loader()

    def _kill_endless_runs(self) -> None:
        """Kill runs that exceed the limit of processor time between two choice points."""
        cpu_limit_s = self._execution.cpu_limit_s
        for peer in list(self._peers.values()):
            is_loading = peer is self._loader and not self._is_loaded
            if (
                not (peer.edge or is_loading)
                or not peer.pid
                or time.monotonic() - peer.departure_s < cpu_limit_s
            ):
                continue
            # Real time alone proves nothing: on a busy machine, a run may have waited for a core.
            if forking.read_cpu_seconds(peer.pid) - peer.departure_cpu_s < cpu_limit_s:
                continue
            forking.kill(peer.pid)
            if peer.edge is None:
                raise CxbridgeError(
                    f"the agent has not loaded within {cpu_limit_s:g} s of processor time",
                    hint="the rules may fire endlessly: check with cxbridge run, or raise --patience",
                )
            reason = f"a loop has not ended within {cpu_limit_s:g} s of processor time"
            self.graph.record_end(peer.edge, Leaf("timed out", reason, seconds=0.0, is_given_up=True))
            self._disconnect(peer)

    def close(self) -> None:
        """End all processes and release all resources. Open edges stay open."""
        pids = {peer.pid for peer in self._peers.values()} | {self._loader_pid}
        for pid in pids - {0}:
            with contextlib.suppress(ProcessLookupError):  # the process has ended already
                forking.kill(pid)
        for connection, peer in self._peers.items():
            self.cpu_seconds += peer.reported_cpu_s
            connection.close()
        self._peers.clear()
        self._listening_socket.close()
        self._folder.cleanup()
        if self._loader_pid:
            with contextlib.suppress(ChildProcessError):  # the loader has been collected already
                os.waitpid(self._loader_pid, 0)
            self._loader_pid = 0
