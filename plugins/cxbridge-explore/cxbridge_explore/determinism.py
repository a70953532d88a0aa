"""Checks whether an agent is deterministic, by playing the usual run twice.

An exploration compares states and follows paths, so its result is only valid if equal choices lead to equal
runs. A second usual run, in a separate process, reveals most agents that depend on time or on random numbers.
"""

from __future__ import annotations

import multiprocessing
import random
import signal
import sys
from collections.abc import Callable, Iterable
from contextlib import suppress
from itertools import zip_longest
from typing import TYPE_CHECKING, Final

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, LogLine, RuleFired
from cxbridge.file_access import file_errors
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.spawning import safe_spawn_context
from cxbridge_explore.graph import ROOT, Edge, Graph
from cxbridge_explore.playing import MakeRun
from cxbridge_explore.worlds.points import USUAL, ChoicePoint, DivergedError

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.process import BaseProcess

Moment = tuple[float, str]  # seconds since the start of the run, and a description of the event

_SEED: Final = 1  # any fixed seed, the same for both runs


class _MomentRecorder:
    """Records the events of a run; a chooser that takes the usual options."""

    def __init__(self) -> None:
        self.moments: list[Moment] = []
        self.start_us = 0

    def choose(self, index: int, point: ChoicePoint) -> int:  # noqa: ARG002 - the same option everywhere
        self.moments.append((round(point.seconds, 6), point.subject))
        return USUAL

    def record(self, event: Event) -> None:
        match event:
            case RuleFired():
                text = f"rule {event.rule} fires for {event.basis}"
            case LogLine():
                text = f"log: {event.text}"
            case _:
                text = str(event).replace(f"time_us={event.time_us}, ", "")
        self.moments.append(((event.time_us - self.start_us) / MICROSECONDS, text))


class UsualRun:
    """A fault-free run in a child process, which starts at once.

    :param is_detailed: whether to record all events, not only choice points and the end.
    :param seed: the seed of Python's random numbers; None for a different seed each time.
    """

    def __init__(self, make: MakeRun, *, is_detailed: bool = False, seed: int | None = None) -> None:
        self._receiving, sending = multiprocessing.Pipe(duplex=False)
        arguments = sending, make, is_detailed, seed
        self._process = _start_process(_play, arguments)
        sending.close()

    def moments(self) -> list[Moment] | None:
        """Wait for the end and return the events; None if the run failed."""
        moments: list[Moment] | None = None
        with suppress(EOFError):
            moments = self._receiving.recv()
        self._process.join()
        return moments

    def close(self) -> None:
        """Kill the run if it is still active."""
        self._process.kill()
        self._process.join()
        self._receiving.close()


def _start_process(target: Callable[..., None], arguments: tuple[object, ...]) -> BaseProcess:
    """Start and return a child process. Except on Windows, a fork saves loading the program again."""
    process: BaseProcess
    if sys.platform != "win32":
        process = multiprocessing.get_context("fork").Process(target=target, args=arguments, daemon=True)
        process.start()
        return process
    with safe_spawn_context() as context:
        process = context.Process(target=target, args=arguments, daemon=True)
        process.start()
    return process


def _play(sending: Connection, make: MakeRun, is_detailed: bool, seed: int | None) -> None:
    """Play the usual run in a child process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    random.seed(seed)
    recorder = _MomentRecorder()
    try:
        with file_errors():
            run = make(recorder)
            run.world.start()
        recorder.start_us = run.world.assembly.clock.now_us()
        if is_detailed:
            run.world.assembly.bus.subscribe(recorder.record, LogLine, RuleFired, *TRANSITION_TYPES)
        leaf = run.leaf()
    except CxbridgeError:
        return  # the exploration reports the same error
    sending.send([*recorder.moments, (round(leaf.seconds, 6), f"the end: {leaf.outcome}, {leaf.reason}")])


def usual_moments(graph: Graph) -> list[Moment] | None:
    """Return the events of the usual run in an explored graph; None if the graph lacks it."""
    moments: list[Moment] = []
    edge: Edge = ROOT
    while edge in graph.links:
        number = graph.links[edge]
        node = graph.nodes[number]
        if node.edge != edge:
            return None  # merged with a run that has faults
        moments.append((round(node.point.seconds, 6), node.point.subject))
        edge = number, USUAL
    leaf = graph.leaves.get(edge)
    if leaf is None or leaf.is_given_up:
        return None  # a second run may never end either
    return [*moments, (round(leaf.seconds, 6), f"the end: {leaf.outcome}, {leaf.reason}")]


def explain_difference(make: MakeRun, divergence: DivergedError) -> CxbridgeError:
    """Play the usual run twice more and return the error that explains their difference.

    :param divergence: the difference that was noticed first.
    """
    first, second = _play_twice(make, None)
    difference = _difference(first, second)
    if not difference:
        return CxbridgeError(
            f"the agent is not deterministic: {divergence.message}",
            hint="find code that depends on the time of day, on random numbers or on other processes",
        )
    same_with_seed = not _difference(*_play_twice(make, _SEED))
    cause = (
        "random numbers without a seed: seed the generator, or draw from a world"
        if same_with_seed
        else "most probably the time of day, or another process: use the time of the run's clock"
    )
    return CxbridgeError(f"the agent is not deterministic: {difference}", hint=f"the cause: {cause}")


def _play_twice(make: MakeRun, seed: int | None) -> tuple[list[Moment], list[Moment]]:
    """Return the events of two usual runs, which are played at the same time."""
    runs = [UsualRun(make, is_detailed=True, seed=seed) for _ in range(2)]
    first, second = (run.moments() or [] for run in runs)
    return first, second


def _difference(first: Iterable[Moment], second: Iterable[Moment]) -> str:
    """Return the first difference of two runs; empty if they are equal."""
    for first_moment, second_moment in zip_longest(first, second):
        if first_moment != second_moment:
            moments = f"{_describe(first_moment)}, and {_describe(second_moment)}"
            return f"the first difference of two runs is {moments}"
    return ""


def _describe(moment: Moment | None) -> str:
    return "the end" if moment is None else f"'{moment[1]}' at {moment[0]:.3f} s"
