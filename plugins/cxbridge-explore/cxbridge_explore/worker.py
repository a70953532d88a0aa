"""The processes of an exploration: the loader, and its forked copies, which play runs and fork again."""

from __future__ import annotations

import gc
import os
import random
import sys
import time
from collections.abc import Callable
from typing import NoReturn

from cxbridge.errors import CxbridgeError
from cxbridge.file_access import file_errors
from cxbridge_explore import forking
from cxbridge_explore.graph import Edge, Point, PointOption
from cxbridge_explore.playing import ExploredRun, MakeRun, make_failure_leaf
from cxbridge_explore.state import ComputeDigest, make_digest_function
from cxbridge_explore.use import UsedPart
from cxbridge_explore.wire import (
    ChoicePointReport,
    ContinueOrder,
    CoordinatorLink,
    EndReport,
    ForkOrder,
    Order,
    PlayOrder,
    RefusalReport,
    StartReport,
)
from cxbridge_explore.worlds.points import USUAL, ChoicePoint, Chooser, Option, PathChooser, Step

# Number of new objects after which a copy collects garbage. Collections are rare, since a collection writes
# to memory pages that the copy shares with its parent, which duplicates the pages.
_COLLECTION_THRESHOLD = 50_000


class ExplorationProcess:
    """The state of the current process: its connection to the coordinator, and its forked copies.

    :param address: the path of the coordinator's socket.
    """

    def __init__(self, address: str) -> None:
        self._address = address
        self._copies: list[int] = []
        self.link = CoordinatorLink(address)
        self.link.send(StartReport(os.getpid()))

    def fork_copy(self, edge: Edge) -> bool:
        """Fork this process for an edge; return True in the copy.

        The connection of the copy is opened before the fork, so that the coordinator notices each death.
        """
        self._reap()
        link = CoordinatorLink(self._address)
        link.send(StartReport(0, edge))
        try:
            pid = forking.fork()
        except OSError as error:
            self.link.send(RefusalReport(f"the system cannot make another process: {error.strerror}"))
            exit_process(1)
        if pid:
            self._copies.append(pid)
            link.close()
            return False
        self.link.close()
        self.link = link
        self._copies.clear()  # the earlier copies are children of the parent
        link.send(StartReport(os.getpid(), edge))
        return True

    def _reap(self) -> None:
        """Forget the copies that have ended, so that the system can forget them, too."""
        self._copies = [pid for pid in self._copies if not forking.has_ended(pid)]


class ForkingChooser:
    """A chooser that reports each choice point to the coordinator, and forks on the coordinator's orders.

    :param first_reported: see :class:`~cxbridge_explore.wire.PlayOrder`.
    :param compute_digest: computes the digest of a state.
    :param collect_used_parts: returns the parts of the agent that were used for the first time since its
        last call.
    """

    def __init__(
        self,
        process: ExplorationProcess,
        first_reported: int,
        compute_digest: ComputeDigest,
        collect_used_parts: Callable[[], tuple[UsedPart, ...]],
    ) -> None:
        self._process = process
        self._first_reported = first_reported
        self._compute_digest = compute_digest
        self._collect_used_parts = collect_used_parts

    def choose(self, index: int, point: ChoicePoint) -> int:
        """Return the option in an order; exit if the coordinator orders no option."""
        if index < self._first_reported:
            return USUAL
        try:
            self._process.link.send(
                ChoicePointReport(
                    make_point(index, point),
                    *self._compute_digest(point),
                    time.process_time(),
                    self._collect_used_parts(),
                )
            )
            return self._follow_orders()
        except (EOFError, OSError):
            exit_process(1)  # the coordinator is gone

    def _follow_orders(self) -> int:
        """Carry out orders until an order gives this process an option."""
        while True:
            match self._process.link.receive():
                case ForkOrder(edge):
                    if self._process.fork_copy(edge):
                        _, option = edge
                        return option
                case ContinueOrder(option):
                    return option
                case _:
                    exit_process()


def make_point(index: int, point: ChoicePoint) -> Point:
    """Return a choice point as the graph stores it."""
    options = tuple(PointOption(option.name, option.faults) for option in point.options)
    return Point(index, point.kind.value, point.subject, point.seconds, options)


def exit_process(status: int = 0) -> NoReturn:
    """Exit without cleanup, since other processes share the resources of this process."""
    os._exit(status)


class _DeferredChooser:
    """A chooser that delegates to a chooser that is set after the run is made."""

    def __init__(self) -> None:
        self.chooser: Chooser

    def choose(self, index: int, point: ChoicePoint) -> int | Option:
        return self.chooser.choose(index, point)


def run_loader(address: str, make_run: MakeRun, *, merge: bool) -> NoReturn:
    """Load the scenario, and fork this process for each path to play.

    The function must be called in a new process, and never returns.

    :param merge: whether to compare states.
    """
    forking.reset_signals()  # the coordinator, which Ctrl-C reaches too, ends this process
    # Different seeds in the processes reveal agents that draw random numbers without a seed.
    random.seed()
    try:
        process = ExplorationProcess(address)
        _load_and_fork(process, make_run, merge=merge)
    except (EOFError, OSError):
        exit_process(1)  # the coordinator is gone
    except BaseException as error:  # noqa: BLE001 - a copy must never return into the coordinator's code
        sys.excepthook(type(error), error, error.__traceback__)
        exit_process(1)


def _load_and_fork(process: ExplorationProcess, make_run: MakeRun, *, merge: bool) -> NoReturn:
    deferred_chooser = _DeferredChooser()
    try:
        with file_errors():
            run = make_run(deferred_chooser)
            run.world.start()
    except CxbridgeError as error:
        # names of files may contain bytes that are not text
        process.link.send(RefusalReport(str(error).encode("utf-8", "backslashreplace").decode()))
        exit_process()
    compute_digest = make_digest_function(run, merge=merge)
    gc.collect()
    gc.freeze()  # later collections skip the present objects, whose pages the copies share
    gc.set_threshold(_COLLECTION_THRESHOLD, 10, 10)
    process.link.send(StartReport(os.getpid()))
    while True:
        order: Order = process.link.receive()
        if not isinstance(order, PlayOrder):
            exit_process()
        if process.fork_copy(order.edge):
            deferred_chooser.chooser = ForkingChooser(
                process, order.first_reported, compute_digest, run.collect_used_parts
            )
            _play_path(process, run, deferred_chooser, order)


def _play_path(
    process: ExplorationProcess, run: ExploredRun, deferred_chooser: _DeferredChooser, order: PlayOrder
) -> NoReturn:
    path = {index: Step(subject, option) for index, subject, option in order.choices}
    deferred_chooser.chooser = PathChooser(path, deferred_chooser.chooser)
    try:
        leaf = run.play_to_leaf()
    except Exception as error:  # noqa: BLE001 - an agent's Python code may raise anything
        leaf = make_failure_leaf(error)
    process.link.send(EndReport(leaf, time.process_time(), run.collect_used_parts()))
    exit_process()
