"""The processes of an exploration: the loader, and its forks, which run the scenario and fork again."""

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
from cxbridge_explore.playing import ExploredRun, MakeRun, failure
from cxbridge_explore.state import Digest, state_digest
from cxbridge_explore.use import Used
from cxbridge_explore.wire import Continue, Ended, Fork, Hello, Link, Order, Play, Reached, Refused
from cxbridge_explore.worlds.points import USUAL, ChoicePoint, Chooser, Option, PathChooser, Step

# The number of new objects before a garbage collection in a copy. Collections are rare, since they touch the
# pages that the copy shares with its parent.
_GENERATION_SIZE = 50_000


class Process:
    """The current process: its connection to the coordinator, and its forked copies.

    :param address: the path of the coordinator's socket.
    """

    def __init__(self, address: str) -> None:
        self._address = address
        self._copies: list[int] = []
        self.link = Link(address)
        self.link.send(Hello(os.getpid()))

    def copy(self, edge: Edge) -> bool:
        """Fork the process for an edge and return True in the copy.

        The copy's connection is opened before the fork, so the coordinator notices every death.
        """
        self._reap()
        link = Link(self._address)
        link.send(Hello(0, edge))
        try:
            pid = forking.fork()
        except OSError as error:
            self.link.send(Refused(f"the system cannot make another process: {error.strerror}"))
            exit_process(1)
        if pid:
            self._copies.append(pid)
            link.close()
            return False
        self.link.close()
        self.link = link
        self._copies.clear()  # they are children of the parent
        link.send(Hello(os.getpid(), edge))
        return True

    def _reap(self) -> None:
        """Reap the dead copies."""
        self._copies = [pid for pid in self._copies if not forking.has_ended(pid)]


class ForkingChooser:
    """A chooser that reports each choice point to the coordinator, and forks on its orders.

    :param first_reported: see :class:`~cxbridge_explore.wire.Play`.
    :param digest: returns the digest of a state, or an empty digest with the reason.
    :param used: returns the parts of the agent used since the last call.
    """

    def __init__(
        self, process: Process, first_reported: int, digest: Digest, used: Callable[[], tuple[Used, ...]]
    ) -> None:
        self._process = process
        self._first_reported = first_reported
        self._digest = digest
        self._used = used

    def choose(self, index: int, point: ChoicePoint) -> int:
        """Return the ordered option; exit if no option is left."""
        if index < self._first_reported:
            return USUAL
        try:
            self._process.link.send(
                Reached(as_point(index, point), *self._digest(point), time.process_time(), self._used())
            )
            return self._obey()
        except (EOFError, OSError):
            exit_process(1)  # the coordinator is gone

    def _obey(self) -> int:
        """Obey orders until the run of this process has an option to take."""
        while True:
            match self._process.link.receive():
                case Fork(edge):
                    if self._process.copy(edge):
                        _, option = edge
                        return option
                case Continue(option):
                    return option
                case _:
                    exit_process()


def as_point(index: int, point: ChoicePoint) -> Point:
    """Return a choice point as the graph stores it."""
    options = tuple(PointOption(option.name, option.faults) for option in point.options)
    return Point(index, point.kind.value, point.subject, point.seconds, options)


def exit_process(status: int = 0) -> NoReturn:
    """Exit without cleanup: the resources are shared with other processes."""
    os._exit(status)


class _DeferredChooser:
    """A chooser that is set after the run is made."""

    def __init__(self) -> None:
        self.chooser: Chooser

    def choose(self, index: int, point: ChoicePoint) -> int | Option:
        return self.chooser.choose(index, point)


def serve(address: str, make: MakeRun, *, merge: bool) -> NoReturn:
    """Load the scenario and fork this process for each path to play. Never returns.

    Call it in a new process.

    :param merge: whether to compare states.
    """
    forking.let_signals_end()  # the coordinator, which Ctrl-C reaches too, ends this process
    random.seed()  # A different seed in each process reveals agents that use random numbers without a seed.
    try:
        process = Process(address)
        _serve(process, make, merge=merge)
    except (EOFError, OSError):
        exit_process(1)  # the coordinator is gone
    except BaseException as error:  # noqa: BLE001 - a copy must never return into the coordinator's code
        sys.excepthook(type(error), error, error.__traceback__)
        exit_process(1)


def _serve(process: Process, make: MakeRun, *, merge: bool) -> NoReturn:
    deferred = _DeferredChooser()
    try:
        with file_errors():
            run = make(deferred)
            run.world.start()
    except CxbridgeError as error:
        # names of files may contain bytes that are not text
        process.link.send(Refused(str(error).encode("utf-8", "backslashreplace").decode()))
        exit_process()
    digest = state_digest(run, merge=merge)
    gc.collect()
    gc.freeze()  # no collection touches the pages that the copies share with this process
    gc.set_threshold(_GENERATION_SIZE, 10, 10)
    process.link.send(Hello(os.getpid()))
    while True:
        order: Order = process.link.receive()
        if not isinstance(order, Play):
            exit_process()
        if process.copy(order.edge):
            deferred.chooser = ForkingChooser(process, order.first_reported, digest, run.used)
            _play(process, run, deferred, order)


def _play(process: Process, run: ExploredRun, deferred: _DeferredChooser, order: Play) -> NoReturn:
    path = {index: Step(subject, option) for index, subject, option in order.choices}
    deferred.chooser = PathChooser(path, deferred.chooser)
    try:
        leaf = run.leaf()
    except Exception as error:  # noqa: BLE001 - an agent's Python code may raise anything
        leaf = failure(error)
    process.link.send(Ended(leaf, time.process_time(), run.used()))
    exit_process()
