"""Finds out whether an agent decides the same each time: the usual run is played twice."""

from __future__ import annotations

import multiprocessing
import random
import signal
import sys
from collections.abc import Callable, Iterable
from itertools import zip_longest
from typing import TYPE_CHECKING, Final

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, LogLine, RuleFired
from cxbridge.file_access import file_errors
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.process.python import spawning
from cxbridge_explore.graph import ROOT, Edge, Graph
from cxbridge_explore.playing import MakeRun
from cxbridge_explore.worlds.points import USUAL, ChoicePoint, DivergedError

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.process import BaseProcess

Moment = tuple[float, str]
"""Seconds since the run began, and what happened then, for people."""

_SEED: Final = 1


class _Notes:
    """Notes what happens in a run, and takes the usual options."""

    def __init__(self) -> None:
        self.moments: list[Moment] = []
        self.start_us = 0

    def choose(self, index: int, point: ChoicePoint) -> int:  # noqa: ARG002 - all alike
        self.moments.append((round(point.seconds, 6), point.subject))
        return USUAL

    def take(self, event: Event) -> None:
        match event:
            case RuleFired():
                text = f"rule {event.rule} fires for {event.basis}"
            case LogLine():
                text = f"log: {event.text}"
            case _:
                text = str(event).replace(f"time_us={event.time_us}, ", "")
        self.moments.append(((event.time_us - self.start_us) / MICROSECONDS, text))


class UsualRun:
    """A run without a fault in a child process, which begins now.

    :param make: makes the run.
    :param is_detailed: whether all that happens is noted, and not the choice points and the end alone.
    :param seed: of Python's random numbers; None: another one each time.
    """

    def __init__(self, make: MakeRun, *, is_detailed: bool = False, seed: int | None = None) -> None:
        self._receiving, sending = multiprocessing.Pipe(duplex=False)
        arguments = sending, make, is_detailed, seed
        self._process = _started(_play, arguments)
        sending.close()

    def moments(self) -> list[Moment] | None:
        """Wait for its end, and return what happened; None when it broke."""
        try:
            found: list[Moment] | None = self._receiving.recv()
        except EOFError:
            found = None
        self._process.join()
        return found

    def close(self) -> None:
        """End it, if it still runs."""
        self._process.kill()
        self._process.join()
        self._receiving.close()


def _started(target: Callable[..., None], arguments: tuple[object, ...]) -> BaseProcess:
    process: BaseProcess
    if sys.platform != "win32":
        process = multiprocessing.get_context("fork").Process(target=target, args=arguments, daemon=True)
        process.start()
        return process
    with spawning() as context:
        process = context.Process(target=target, args=arguments, daemon=True)
        process.start()
    return process


def _play(sending: Connection, make: MakeRun, is_detailed: bool, seed: int | None) -> None:
    """Play the usual run in a child process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    random.seed(seed)
    notes = _Notes()
    try:
        with file_errors():
            run = make(notes)
            run.world.start()
        notes.start_us = run.world.assembly.clock.now_us()
        if is_detailed:
            run.world.assembly.bus.subscribe(notes.take, LogLine, RuleFired, *TRANSITION_TYPES)
        leaf = run.leaf()
    except CxbridgeError:
        return  # the exploration meets it, too
    sending.send([*notes.moments, (round(leaf.seconds, 6), f"the end: {leaf.outcome}, {leaf.reason}")])


def usual_moments(graph: Graph) -> list[Moment] | None:
    """Return the choice points and the end of the usual run of an exploration; None when it has none."""
    found: list[Moment] = []
    edge: Edge = ROOT
    while edge in graph.links:
        number = graph.links[edge]
        node = graph.nodes[number]
        if node.edge != edge:
            return None  # merged with a run that was not a usual one
        found.append((round(node.point.seconds, 6), node.point.subject))
        edge = number, USUAL
    leaf = graph.leaves.get(edge)
    if leaf is None or leaf.is_given_up:
        return None  # another one might never end
    return [*found, (round(leaf.seconds, 6), f"the end: {leaf.outcome}, {leaf.reason}")]


def explain_difference(make: MakeRun, found: DivergedError) -> CxbridgeError:
    """Return the explanation for an agent whose runs differed; plays the usual run twice more.

    :param found: how that was noticed.
    """
    first, second = _two(make, None)
    difference = _difference(first, second)
    if not difference:
        return CxbridgeError(
            f"the agent is not deterministic: {found.message}",
            hint="look for what depends on the time of day, on random numbers or on other processes",
        )
    same_with_seed = not _difference(*_two(make, _SEED))
    cause = (
        "random numbers without a seed: seed the generator, or draw from a world"
        if same_with_seed
        else "most probably the time of day, or another process; take the time of the run's clock"
    )
    return CxbridgeError(f"the agent is not deterministic: {difference}", hint=f"the cause: {cause}")


def _two(make: MakeRun, seed: int | None) -> tuple[list[Moment], list[Moment]]:
    runs = [UsualRun(make, is_detailed=True, seed=seed) for _ in range(2)]
    first, second = (run.moments() or [] for run in runs)
    return first, second


def _difference(first: Iterable[Moment], second: Iterable[Moment]) -> str:
    """Return the first difference of two runs; empty: none."""
    for one, other in zip_longest(first, second):
        if one != other:
            return f"the first difference of two runs is {_words(one)}, and {_words(other)}"
    return ""


def _words(moment: Moment | None) -> str:
    return "the end" if moment is None else f"'{moment[1]}' at {moment[0]:.3f} s"
