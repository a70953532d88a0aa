"""Checks whether an agent is deterministic, by playing the usual run twice.

An exploration compares states and follows paths, so that its result is valid only if equal choices lead to
equal runs. The usual run is the run without a fault. A second usual run, in a separate process, reveals most
agents that depend on the time of day or on random numbers.
"""

from __future__ import annotations

import multiprocessing
import random
import signal
import sys
from collections.abc import Callable, Iterable
from contextlib import suppress
from itertools import zip_longest
from typing import TYPE_CHECKING

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, LogLine, RuleFired
from cxbridge.file_access import file_errors
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge_explore.graph import ROOT_EDGE, Edge, Graph
from cxbridge_explore.playing import MakeRun
from cxbridge_explore.spawning import start_safe_process
from cxbridge_explore.worlds.points import USUAL, ChoicePoint, DivergedError

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.process import BaseProcess

EventRecord = tuple[float, str]  # seconds since the start of the run, and a description of the event


class _EventRecorder:
    """A chooser that takes the usual options, and records the choice points and events of the run."""

    def __init__(self) -> None:
        self.records: list[EventRecord] = []
        self.start_us = 0

    def choose(self, point: ChoicePoint) -> int:
        # rounded to microseconds, as in the records of a graph
        self.records.append((round(point.seconds, 6), point.subject))
        return USUAL

    def record(self, event: Event) -> None:
        match event:
            case RuleFired():
                text = f"rule {event.rule} fires for {event.basis}"
            case LogLine():
                text = f"log: {event.text}"
            case _:
                text = str(event).replace(f"time_us={event.time_us}, ", "")  # the record has the time
        self.records.append(((event.time_us - self.start_us) / MICROSECONDS, text))


class UsualRun:
    """A usual run in a child process, which starts at once.

    :param is_detailed: whether to record fired rules, transitions and log lines, too, not only choice points
        and the end.
    """

    def __init__(self, make_run: MakeRun, *, is_detailed: bool = False) -> None:
        self._receiver, sender = multiprocessing.Pipe(duplex=False)
        self._process = _start_process(_play_usual_run, (sender, make_run, is_detailed))
        sender.close()

    def wait_for_records(self) -> list[EventRecord] | None:
        """Wait for the end of the run and return its records; None if the run has failed."""
        records: list[EventRecord] | None = None
        with suppress(EOFError):
            records = self._receiver.recv()
        self._process.join()
        return records

    def close(self) -> None:
        """Kill a run that is still active."""
        self._process.kill()
        self._process.join()
        self._receiver.close()


def _start_process(target: Callable[..., None], arguments: tuple[object, ...]) -> BaseProcess:
    """Start and return a child process. A fork, where possible, saves the time of loading the program."""
    if sys.platform == "win32":
        return start_safe_process(target, *arguments)
    process = multiprocessing.get_context("fork").Process(target=target, args=arguments, daemon=True)
    process.start()
    return process


def _play_usual_run(sender: Connection, make_run: MakeRun, is_detailed: bool) -> None:
    """Play the usual run in a child process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches this process, too; the parent ends it
    random.seed()  # differently in each run, which reveals agents that draw without a seed
    recorder = _EventRecorder()
    try:
        with file_errors():
            run = make_run(recorder)
            run.start()
        recorder.start_us = run.assembly.clock.now_us()
        if is_detailed:
            run.assembly.bus.subscribe(recorder.record, LogLine, RuleFired, *TRANSITION_TYPES)
        leaf = run.play_to_leaf()
    except CxbridgeError:
        return  # the exploration reports the same error
    sender.send([*recorder.records, (round(leaf.seconds, 6), f"the end: {leaf.outcome}, {leaf.reason}")])


def find_usual_records(graph: Graph) -> list[EventRecord] | None:
    """Return the records of the usual run in an explored graph.

    :returns: None if the graph lacks that run or its end.
    """
    records: list[EventRecord] = []
    edge: Edge = ROOT_EDGE
    while edge in graph.links:
        number = graph.links[edge]
        node = graph.nodes[number]
        if node.edge != edge:
            return None  # the usual run was merged with a run that has faults
        records.append((round(node.point.seconds, 6), node.point.subject))
        edge = number, USUAL
    leaf = graph.leaves.get(edge)
    if leaf is None or leaf.is_given_up:
        return None  # the usual run did not end, and a second run may not end either
    return [*records, (round(leaf.seconds, 6), f"the end: {leaf.outcome}, {leaf.reason}")]


def explain_difference(make_run: MakeRun, divergence: DivergedError) -> CxbridgeError:
    """Play two more usual runs, and return an error that explains their difference.

    :param divergence: the difference that has ended the exploration, which the error names if the two runs
        are equal.
    """
    runs = [UsualRun(make_run, is_detailed=True) for _ in range(2)]
    first_records, second_records = (run.wait_for_records() or [] for run in runs)
    difference = _describe_difference(first_records, second_records) or divergence.message
    return CxbridgeError(
        f"the agent is not deterministic: {difference}",
        hint="find code that depends on the time of day, on other processes, or on random numbers without a "
        "seed",
    )


def _describe_difference(first_records: Iterable[EventRecord], second_records: Iterable[EventRecord]) -> str:
    """Return the first difference of two runs as a clause; empty if they are equal."""
    for first_record, second_record in zip_longest(first_records, second_records):
        if first_record != second_record:
            pair_text = f"{_describe_record(first_record)}, and {_describe_record(second_record)}"
            return f"the first difference of two runs is {pair_text}"
    return ""


def _describe_record(record: EventRecord | None) -> str:
    if record is None:
        return "the end"
    seconds, text = record
    return f"'{text}' at {seconds:.3f} s"
