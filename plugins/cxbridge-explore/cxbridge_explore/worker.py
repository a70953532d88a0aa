"""The processes of an exploration: the loader, and its forked copies, which play runs and fork again."""

from __future__ import annotations

import gc
import os
import random
import sys
import time
from typing import NoReturn

from cxbridge.errors import CxbridgeError
from cxbridge.file_access import file_errors
from cxbridge_explore import forking
from cxbridge_explore.graph import Edge
from cxbridge_explore.playing import ExploredRun, MakeRun, make_failure_leaf
from cxbridge_explore.state import ComputeDigest, make_digest_function
from cxbridge_explore.wire import (
    ChoicePointReport,
    ContinueOrder,
    EndReport,
    ForkOrder,
    Order,
    PlayOrder,
    RefusalReport,
    StartReport,
    connect,
    receive_order,
    send,
)
from cxbridge_explore.worlds.points import USUAL, ChoicePoint, PathChooser

# Number of new objects after which a copy collects garbage. Collections are rare, since a collection writes
# to memory pages that the copy shares with its parent, which duplicates the pages.
_COLLECTION_THRESHOLD = 50_000


class ExplorationProcess:
    """The state of the current process: its connection to the coordinator, and its forked copies.

    :param address: the path of the coordinator's socket.
    """

    def __init__(self, address: str) -> None:
        self._address = address
        self._copy_pids: list[int] = []
        self.connection = connect(address)
        send(self.connection, StartReport(os.getpid()))

    def fork_copy(self, edge: Edge) -> bool:
        """Fork this process for an edge; return True in the copy.

        The connection of the copy is opened before the fork, so that the coordinator notices each death. If
        the system cannot make another process, this process reports so and exits.
        """
        # the system keeps an ended copy until its parent has asked for its end
        self._copy_pids = [pid for pid in self._copy_pids if not forking.has_ended(pid)]
        connection = connect(self._address)
        send(connection, StartReport(0, edge))
        try:
            pid = forking.fork()
        except OSError as error:
            reason = f"the system cannot make another process: {error.strerror}"
            send(self.connection, RefusalReport(reason))
            exit_process(1)
        if pid:
            self._copy_pids.append(pid)
            connection.close()  # in this process; the copy has the same connection open
            return False
        self.connection.close()
        self.connection = connection
        self._copy_pids.clear()  # the earlier copies are children of the parent
        send(connection, StartReport(os.getpid(), edge))
        return True


class ForkingChooser:
    """A chooser that reports choice points to the coordinator, and forks on the coordinator's orders.

    :param first_reported_index: see :class:`~cxbridge_explore.wire.PlayOrder`.
    :param compute_digest: computes the digest of a state.
    """

    def __init__(
        self,
        process: ExplorationProcess,
        run: ExploredRun,
        first_reported_index: int,
        compute_digest: ComputeDigest,
    ) -> None:
        self._process = process
        self._run = run
        self._first_reported_index = first_reported_index
        self._compute_digest = compute_digest

    def choose(self, point: ChoicePoint) -> int:
        """Return the option in an order; exit if the coordinator orders no option.

        Before the first reported choice point, return the usual option.
        """
        if point.index < self._first_reported_index:
            return USUAL
        try:
            send(
                self._process.connection,
                ChoicePointReport(
                    point.without_data(),
                    *self._compute_digest(point),
                    time.process_time(),
                    self._run.collect_used_parts(),
                ),
            )
            return self._follow_orders()
        except (EOFError, OSError):
            exit_process(1)  # the coordinator is gone

    def _follow_orders(self) -> int:
        """Carry out orders until an order gives this process an option."""
        while True:
            match receive_order(self._process.connection):
                case ForkOrder(edge):
                    if self._process.fork_copy(edge):
                        _, option = edge
                        return option
                case ContinueOrder(option):
                    return option
                case _:
                    exit_process()


def exit_process(status: int = 0) -> NoReturn:
    """Exit without cleanup, since other processes share the resources of this process."""
    os._exit(status)


def run_loader(address: str, make_run: MakeRun, *, merges_states: bool) -> NoReturn:
    """Load the scenario, and fork this process for each path to play.

    The function must be called in a new process, and never returns.

    :param merges_states: whether to compare states.
    """
    forking.reset_signals()  # the coordinator, which Ctrl-C reaches too, ends this process
    # Different seeds in the processes reveal agents that draw random numbers without a seed.
    random.seed()
    try:
        process = ExplorationProcess(address)
        _load_and_fork(process, make_run, merges_states=merges_states)
    except (EOFError, OSError):
        exit_process(1)  # the coordinator is gone
    except BaseException as error:  # noqa: BLE001 - a copy must never return into the coordinator's code
        sys.excepthook(type(error), error, error.__traceback__)
        exit_process(1)


def _load_and_fork(process: ExplorationProcess, make_run: MakeRun, *, merges_states: bool) -> NoReturn:
    try:
        with file_errors():
            run = make_run(PathChooser({}))
            run.start()
    except CxbridgeError as error:
        # names of files may contain bytes that are not text
        reason = str(error).encode("utf-8", "backslashreplace").decode()
        send(process.connection, RefusalReport(reason))
        exit_process()
    compute_digest = make_digest_function(run, merges_states=merges_states)
    gc.collect()
    gc.freeze()  # later collections skip the present objects, whose pages the copies share
    # 10 and 10 are Python's defaults for the older generations of objects
    gc.set_threshold(_COLLECTION_THRESHOLD, 10, 10)
    send(process.connection, StartReport(os.getpid()))
    while True:
        order: Order = receive_order(process.connection)
        if not isinstance(order, PlayOrder):
            exit_process()
        if process.fork_copy(order.edge):
            forking_chooser = ForkingChooser(process, run, order.first_reported_index, compute_digest)
            run.choices.chooser = PathChooser(order.path, forking_chooser)
            _play_run(process, run)


def _play_run(process: ExplorationProcess, run: ExploredRun) -> NoReturn:
    try:
        leaf = run.play_to_leaf()
    except Exception as error:  # noqa: BLE001 - an agent's Python code may raise anything
        leaf = make_failure_leaf(error)
    send(process.connection, EndReport(leaf, time.process_time(), run.collect_used_parts()))
    exit_process()
