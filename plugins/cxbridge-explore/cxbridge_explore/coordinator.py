"""Coordinates the processes of an exploration: owns the graph, and resumes or forks runs.

The exploration is depth-first: the run that reached its choice point last continues first, so that few runs
wait. If a process dies, its edge stays open, and another process replays the path to the edge.
"""

from __future__ import annotations

import contextlib
import os
import selectors
import socket
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

from cxbridge.closing import Closing
from cxbridge.errors import CxbridgeError
from cxbridge_explore import forking
from cxbridge_explore.bounds import ExecutionOptions
from cxbridge_explore.graph import BAD_INPUT, DIVERGED, Edge, Graph, Leaf
from cxbridge_explore.wire import (
    Continue,
    Ended,
    Fork,
    Hello,
    Leave,
    Order,
    Play,
    Reached,
    Refused,
    Report,
    Reports,
    frame,
)
from cxbridge_explore.worlds.points import DivergedError

_POLL_S: Final = 0.25  # time between two checks of the processes
_MAX_DEATHS: Final = 3  # number of deaths of processes after which an edge counts as crashed
_BACKLOG: Final = 128  # limit of connections that wait to be accepted
_CHUNK_BYTES: Final = 65536  # limit of bytes that are read at once


class _Peer:
    """A process of the exploration.

    :ivar edge: the open edge of its run; None while the run waits.
    :ivar options: the unexplored edges of the choice point at which its run waits, the usual option first.
    """

    def __init__(self, connection: socket.socket) -> None:
        self.connection = connection
        self.reports = Reports()
        self.pid = 0
        self.edge: Edge | None = None
        self.options: list[Edge] = []
        self.ordered: list[Edge] = []  # edges of ordered copies that have not reported yet
        self.reported_cpu_s = 0.0  # processor time, as the process reports it
        # Real and processor time when the run left its last choice point.
        self.mark_s = time.monotonic()
        self.mark_cpu_s = 0.0

    def take(self, edge: Edge) -> None:
        """Put the run of the process on an edge."""
        self.edge = edge
        self.mark()

    def release(self) -> Edge:
        """Return the edge of the run, and take the run off the edge."""
        edge, self.edge = self.edge, None
        if edge is None:
            raise ValueError("a process without an edge has sent a report about its run")
        return edge

    def mark(self) -> None:
        """Restart the measurement of the run's time since its last choice point."""
        self.mark_s, self.mark_cpu_s = time.monotonic(), forking.cpu_seconds(self.pid)

    def send(self, order: Order) -> None:
        """Send an order. The end of the connection reveals a dead process."""
        with contextlib.suppress(OSError):
            self.connection.sendall(frame(order))


class Coordinator(Closing):
    """Explores with processes until no edge is open. A context manager.

    :param graph: the known graph, whose open edges are explored.
    :param serve: runs the process that loads the scenario, given the address of the coordinator's socket.
    """

    def __init__(self, graph: Graph, execution: ExecutionOptions, serve: Callable[[str], object]) -> None:
        self.graph = graph
        self.unmerged_reasons: dict[str, None] = {}  # reasons why states were not compared, in order
        # Processor time of all copies, without this process and the loader.
        self.cpu_seconds = 0.0
        self._execution, self._serve = execution, serve
        self._folder = tempfile.TemporaryDirectory(prefix="cxbridge-explore-")
        self._address = str(Path(self._folder.name) / "socket")
        self._listening = forking.local_socket()
        self._listening.bind(self._address)
        self._listening.listen(_BACKLOG)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listening, selectors.EVENT_READ)
        self._peers: dict[socket.socket, _Peer] = {}
        self._waiting_runs: list[_Peer] = []  # at choice points with unexplored options
        self._pending_edges: list[Edge] = list(graph.open)[::-1]  # edges without a process
        self._attempts: dict[Edge, int] = {}
        self._loader: _Peer | None = None
        self._loader_pid = 0
        self._is_ready = False
        self._deaths = 0

    # ---- main loop

    def explore(self, is_over: Callable[[], bool]) -> None:
        """Explore until no edge is open or ``is_over`` returns True."""
        self._load()
        while self.graph.open and not is_over():
            self._schedule()
            for key, _ in self._selector.select(_POLL_S):
                if key.data is None:
                    self._accept()
                else:
                    self._receive(key.data)
            self._kill_endless_runs()
            self._restart_loader()

    def _load(self) -> None:
        """Start the process that loads the scenario."""
        self._is_ready = False
        pid = forking.fork()
        if not pid:
            self._listening.close()
            self._serve(self._address)  # never returns
            os._exit(1)
        self._loader_pid = pid

    def _accept(self) -> None:
        connection, _ = self._listening.accept()
        self._peers[connection] = peer = _Peer(connection)
        self._selector.register(connection, selectors.EVENT_READ, peer)

    # ---- active runs

    @property
    def _active_runs(self) -> int:
        """The number of runs that are playing, and of ordered copies."""
        return sum((peer.edge is not None) + len(peer.ordered) for peer in self._peers.values())

    def _schedule(self) -> None:
        """Resume as many runs as the limit allows."""
        for _ in range(self._execution.processes - self._active_runs):
            if self._waiting_runs:  # the latest first, so that few runs wait
                self._continue_run(self._waiting_runs[-1])
            elif self._pending_edges and self._is_ready and self._loader is not None:
                self._start_run(self._loader, self._pending_edges.pop())
            else:
                return

    def _continue_run(self, peer: _Peer) -> None:
        """Fork a waiting run for its next option; the last option is taken by the run itself."""
        edge = peer.options.pop()
        if peer.options:
            self._order_copy(peer, edge, Fork(edge))
            return
        self._waiting_runs.remove(peer)
        peer.take(edge)
        _, option = edge
        peer.send(Continue(option))

    def _start_run(self, loader: _Peer, edge: Edge) -> None:
        """Start a run from the beginning along the path to an edge."""
        path = self.graph.path_to(edge)
        choices = tuple((index, step.subject, step.option) for index, step in path.items())
        first_reported = self.graph.point_number(edge)
        self._order_copy(loader, edge, Play(edge, choices, first_reported))

    @staticmethod
    def _order_copy(peer: _Peer, edge: Edge, order: Order) -> None:
        """Order a process to fork for an edge."""
        peer.ordered.append(edge)
        peer.send(order)

    # ---- reports

    def _receive(self, peer: _Peer) -> None:
        try:
            data = peer.connection.recv(_CHUNK_BYTES)
        except OSError:
            data = b""
        for report in peer.reports.feed(data):
            if peer.connection in self._peers:  # a report may disconnect the process
                self._handle(peer, report)
        if not data:
            self._handle_death(peer)

    def _handle(self, peer: _Peer, report: Report) -> None:
        match report:
            case Hello():
                self._greet(peer, report)
            case Reached():
                self._handle_choice_point(peer, report)
            case Ended():
                peer.reported_cpu_s = report.cpu_s
                self.graph.used.update(report.used)
                if report.leaf.outcome == BAD_INPUT:
                    raise CxbridgeError(report.leaf.reason)
                if report.leaf.outcome == DIVERGED:
                    raise DivergedError(report.leaf.reason)
                self.graph.record_end(peer.release(), report.leaf)
            case Refused():
                raise CxbridgeError(report.text)

    def _greet(self, peer: _Peer, hello: Hello) -> None:
        if hello.edge is None:
            self._is_ready = self._loader is peer
            self._loader, peer.pid = peer, hello.pid
        elif hello.pid:
            peer.pid = hello.pid
            peer.mark()
        else:  # The parent opens the connection for its copy, so the copy greets a second time.
            parent = next((other for other in self._peers.values() if hello.edge in other.ordered), None)
            if parent is None:
                self._disconnect(peer)  # the parent died before the fork; its edge is pending again
            else:
                parent.ordered.remove(hello.edge)
                peer.take(hello.edge)

    def _handle_choice_point(self, peer: _Peer, report: Reached) -> None:
        peer.reported_cpu_s = report.cpu_s
        self.graph.used.update(report.used)
        if report.unmerged_reason:
            self.unmerged_reasons[report.unmerged_reason] = None
        number = self.graph.record_choice_point(peer.release(), report.point, report.digest)
        if number is None:
            peer.send(Leave())
            return
        peer.options = [(number, option) for option in self.graph.options(number)]
        self._waiting_runs.append(peer)
        if len(peer.options) == 1:
            self._continue_run(peer)

    # ---- dead processes

    def _disconnect(self, peer: _Peer) -> None:
        """Close the connection of a process. The process ends when it notices."""
        self._selector.unregister(peer.connection)
        peer.connection.close()
        del self._peers[peer.connection]
        self.cpu_seconds += peer.reported_cpu_s

    def _handle_death(self, peer: _Peer) -> None:
        """Reopen the edges of a process that has died."""
        if peer.connection not in self._peers:
            return
        self._disconnect(peer)
        if peer in self._waiting_runs:
            self._waiting_runs.remove(peer)
        if peer is self._loader:
            self._loader, self._is_ready = None, False
        self._pending_edges += [*peer.options, *peer.ordered]
        if peer.edge is not None:
            self._retry(peer.edge)

    def _retry(self, edge: Edge) -> None:
        """Explore an edge again after the death of its process, up to a number of deaths."""
        self._attempts[edge] = self._attempts.get(edge, 0) + 1
        if self._attempts[edge] < _MAX_DEATHS:
            self._pending_edges.append(edge)
        else:
            reason = f"its process ended {_MAX_DEATHS} times without a report"
            self.graph.record_end(edge, Leaf("crashed", reason, 0.0, is_given_up=True))

    def _restart_loader(self) -> None:
        """Restart the loader if it has died."""
        if not forking.has_ended(self._loader_pid):
            return
        self._loader_pid = 0
        self._deaths += 1
        if self._deaths >= _MAX_DEATHS and not self.graph.nodes and not self.graph.leaves:
            raise CxbridgeError("the process that loads the scenario ends each time without a report")
        self._load()

    def _kill_endless_runs(self) -> None:
        """Kill runs that exceed the processor time between two choice points."""
        patience_s = self._execution.patience_s
        for peer in list(self._peers.values()):
            is_loading = peer is self._loader and not self._is_ready
            if not (peer.edge or is_loading) or not peer.pid or time.monotonic() - peer.mark_s < patience_s:
                continue
            # Real time alone proves nothing: on a busy machine, a run may wait for a core.
            if forking.cpu_seconds(peer.pid) - peer.mark_cpu_s < patience_s:
                continue
            forking.kill(peer.pid)
            if peer.edge is None:
                raise CxbridgeError(
                    f"the agent is not loaded within {patience_s:g} s of processor time",
                    hint="the rules may fire endlessly: check with cxbridge run, or raise --patience",
                )
            reason = f"no end of a loop within {patience_s:g} s of processor time"
            self.graph.record_end(peer.edge, Leaf("timed out", reason, 0.0, is_given_up=True))
            self._disconnect(peer)

    def close(self) -> None:
        """End all processes and release all resources. Open edges stay open."""
        pids = {peer.pid for peer in self._peers.values()} | {self._loader_pid}
        for pid in pids - {0}:
            with contextlib.suppress(ProcessLookupError):
                forking.kill(pid)
        for connection, peer in self._peers.items():
            self.cpu_seconds += peer.reported_cpu_s
            connection.close()
        self._peers.clear()
        self._selector.close()
        self._listening.close()
        self._folder.cleanup()
        if self._loader_pid:
            with contextlib.suppress(ChildProcessError):
                os.waitpid(self._loader_pid, 0)
            self._loader_pid = 0
