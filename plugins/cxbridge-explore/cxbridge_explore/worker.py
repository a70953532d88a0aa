"""The processes of an exploration: one has loaded the scenario, its copies run it and copy themselves."""

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
from cxbridge.process import forking
from cxbridge_explore.graph import Edge, Point, Way
from cxbridge_explore.playing import ExploredRun, MakeRun, failure
from cxbridge_explore.state import Digest, state_digest
from cxbridge_explore.use import Used
from cxbridge_explore.wire import Ended, Fork, GoOn, Hello, Link, Order, Play, Reached, Refused
from cxbridge_explore.worlds.points import USUAL, ChoicePoint, Chooser, Option, PathChooser, Step

_GENERATION_SIZE = 50_000
"""Objects between two collections of a copy: each one touches pages that the copy shares with its parent."""


class Process:
    """The connection of this process, and how it makes copies of itself.

    :param address: of the coordinator's socket.
    """

    def __init__(self, address: str) -> None:
        self._address = address
        self._copies: list[int] = []
        self.link = Link(address)
        self.link.send(Hello(os.getpid()))

    def copy(self, edge: Edge) -> bool:
        """Make a copy of the process for an edge; returns True in the copy.

        The copy's connection exists before the copy: however the copy dies, the coordinator notices.
        """
        self._bury()
        link = Link(self._address)
        link.send(Hello(0, edge))
        try:
            pid = forking.fork()
        except OSError as error:
            self.link.send(Refused(f"the system cannot make another process: {error.strerror}"))
            leave(1)
        if pid:
            self._copies.append(pid)
            link.close()
            return False
        self.link.close()
        self.link = link
        self._copies.clear()
        link.send(Hello(os.getpid(), edge))
        return True

    def _bury(self) -> None:
        """Let go of the copies that are dead."""
        self._copies = [pid for pid in self._copies if not forking.has_ended(pid)]


class ForkingChooser:
    """Asks the coordinator at each choice point, and makes the copies that it wants.

    :param process: this one.
    :param free: the number of the first choice point that is decided; earlier points take the usual option.
    :param digest: returns the digest of a state, or empty and the reason why states are not compared.
    :param used: returns the parts of the agent that the run has used since the last call.
    """

    def __init__(
        self, process: Process, free: int, digest: Digest, used: Callable[[], tuple[Used, ...]]
    ) -> None:
        self._process = process
        self._free = free
        self._digest = digest
        self._used = used

    def choose(self, index: int, point: ChoicePoint) -> int:
        """Return the coordinator's order; does not return when nothing is left to do."""
        if index < self._free:
            return USUAL
        try:
            self._process.link.send(
                Reached(as_point(index, point), *self._digest(point), time.process_time(), self._used())
            )
            return self._obey()
        except (EOFError, OSError):
            leave(1)  # the coordinator is gone

    def _obey(self) -> int:
        while True:
            match self._process.link.receive():
                case Fork(edge):
                    if self._process.copy(edge):
                        return edge[1]
                case GoOn(option):
                    return option
                case _:
                    leave()


def as_point(index: int, point: ChoicePoint) -> Point:
    """Return a choice point as the graph keeps it."""
    ways = tuple(Way(option.name, option.faults) for option in point.options)
    return Point(index, point.kind.value, point.subject, point.seconds, ways)


def leave(status: int = 0) -> NoReturn:
    """End this process without a clean-up: its resources are shared."""
    os._exit(status)


class _Later:
    """A chooser that is not known yet when the run is made."""

    def __init__(self) -> None:
        self.chooser: Chooser

    def choose(self, index: int, point: ChoicePoint) -> int | Option:
        return self.chooser.choose(index, point)


def serve(address: str, make: MakeRun, *, merge: bool) -> NoReturn:
    """Load the scenario, and copy this process for each path that the coordinator wants to be played.

    To be called in a new process; never returns.

    :param make: makes the run.
    :param merge: whether states are compared.
    """
    forking.let_signals_end()  # the coordinator has got Ctrl-C, too, and ends us
    random.seed()  # different in each process: so an agent that uses it unseeded is found out
    try:
        process = Process(address)
        _serve(process, make, merge=merge)
    except (EOFError, OSError):
        leave(1)  # the coordinator is gone
    except BaseException as error:  # noqa: BLE001 - no copy may go on with what the coordinator does
        sys.excepthook(type(error), error, error.__traceback__)
        leave(1)


def _serve(process: Process, make: MakeRun, *, merge: bool) -> NoReturn:
    later = _Later()
    try:
        with file_errors():
            run = make(later)
            run.world.start()
    except CxbridgeError as error:
        # names of files may hold bytes that are not text
        process.link.send(Refused(str(error).encode("utf-8", "backslashreplace").decode()))
        leave()
    digest = state_digest(run, merge=merge)
    gc.collect()
    gc.freeze()
    gc.set_threshold(_GENERATION_SIZE, 10, 10)
    process.link.send(Hello(os.getpid()))
    while True:
        order: Order = process.link.receive()
        if not isinstance(order, Play):
            leave()
        if process.copy(order.edge):
            later.chooser = ForkingChooser(process, order.free, digest, run.used)
            _play(process, run, later, order)


def _play(process: Process, run: ExploredRun, later: _Later, order: Play) -> NoReturn:
    path = {index: Step(subject, option) for index, subject, option in order.choices}
    later.chooser = PathChooser(path, later.chooser)
    try:
        leaf = run.leaf()
    except Exception as error:  # noqa: BLE001 - an agent's Python may fail in any way
        leaf = failure(error)
    process.link.send(Ended(leaf, time.process_time(), run.used()))
    leave()
