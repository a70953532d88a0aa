"""Explores a scenario: plays every way that its runs can go, within bounds.

A run reaches choice points, at which the world decides the next event, such as the failure of a skill. An
exploration plays a run for each option of each choice point, and merges runs that reach equal states. The
usual run is the run without a fault.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from typing import NoReturn

from cxbridge.run.options import RunOptions
from cxbridge_explore.bounds import Bounds, ExecutionOptions
from cxbridge_explore.checkpoint import load_checkpoint, make_identity
from cxbridge_explore.coordinator import Coordinator
from cxbridge_explore.determinism import UsualRun, explain_difference, find_usual_records
from cxbridge_explore.graph import Graph
from cxbridge_explore.playing import ExploredRun
from cxbridge_explore.progress import ProgressReporter
from cxbridge_explore.properties.monitor import Property
from cxbridge_explore.properties.selection import select_properties
from cxbridge_explore.replaying import explore_by_replay
from cxbridge_explore.result import ExploreResult
from cxbridge_explore.worker import run_loader
from cxbridge_explore.worldmodel.model import WorldModel
from cxbridge_explore.worlds.points import DivergedError
from cxbridge_explore.worlds.run import MakeAssembly, make_scenario


def explore(  # noqa: PLR0913 - the options of the command, and two callbacks for the progress
    options: RunOptions,
    bounds: Bounds,
    execution: ExecutionOptions,
    *,
    properties: Sequence[Property] | None = None,
    world: WorldModel | None = None,
    make_assembly: MakeAssembly = make_scenario,
    resume: Path | None = None,
    show_line: Callable[[str], None] = lambda _text: None,
    draw_page: Callable[[ExploreResult], None] = lambda _result: None,
) -> ExploreResult:
    """Explore until no edge of the graph is open, or a signal requests the end.

    The calling process must have no other threads, since this function forks the process.

    :param options: the options of ``cxbridge run``.
    :param properties: the properties of every run; None for the built-in properties and the properties in the
        scenario's folder.
    :param world: the possible events; None for the file in the scenario's folder.
    :param make_assembly: makes the program to run.
    :param resume: the checkpoint of an interrupted exploration.
    :param show_line: called with a line about the progress, several times a second.
    :param draw_page: called with the result so far, every few seconds.
    :raises CxbridgeError: if the scenario or an option is invalid, or the agent is not deterministic.
    """
    options.check()
    properties = select_properties(options) if properties is None else properties
    execution.check()
    make_explored_run = partial(
        ExploredRun,
        options,
        properties,
        world=world,
        make_assembly=make_assembly,
        records_used_parts=execution.coverage,
    )
    if resume is None:
        graph = Graph(bounds.faults, bounds.depth)
    else:
        graph = load_checkpoint(resume, make_identity(options, bounds, properties, world, make_assembly))
    copies_cpu_s = 0.0
    start_s, start_cpu_s = time.perf_counter(), _read_cpu_seconds()

    def make_result() -> ExploreResult:
        cpu_s = _read_cpu_seconds() - start_cpu_s + copies_cpu_s
        return ExploreResult(graph, tuple(properties), cpu_s, time.perf_counter() - start_s)

    progress = ProgressReporter(graph, show_line, lambda: draw_page(make_result()))
    # The usual run is played a second time in parallel, in a process that is forked before all others, for
    # the comparison in `_check_determinism`.
    with _record_signals() as received_signals, closing(UsualRun(make_explored_run)) as usual_run:

        def is_over() -> bool:
            progress.show_if_due()
            return bool(received_signals)

        def load(address: str) -> NoReturn:
            run_loader(address, make_explored_run, merges_states=bounds.merge)

        try:
            if execution.uses_fork:
                with Coordinator(graph, execution, load) as coordinator:
                    coordinator.explore(is_over)
                copies_cpu_s = coordinator.cpu_seconds
            else:
                explore_by_replay(make_explored_run, graph, is_over, merges_states=bounds.merge)
            if not received_signals:
                _check_determinism(graph, usual_run)
        except DivergedError as error:
            raise explain_difference(make_explored_run, error) from None
    return make_result()


def _check_determinism(graph: Graph, usual_run: UsualRun) -> None:
    """Compare the usual run of the exploration with the same run in a second process.

    :raises DivergedError: if the runs differ, so that the agent is not deterministic.
    """
    explored_records = find_usual_records(graph)
    if explored_records is not None and usual_run.wait_for_records() not in (None, explored_records):
        raise DivergedError("two usual runs differ")


def _read_cpu_seconds() -> float:
    """Return the processor time of this process and of its ended children."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


@contextmanager
def _record_signals() -> Iterator[list[int]]:
    """Record the signals that request the end. No thread waits for them, since this process forks."""
    received_signals: list[int] = []

    def record_signal(number: int, _frame: object) -> None:
        if received_signals:
            signal.default_int_handler(number, None)  # the second signal ends the process at once
        received_signals.append(number)

    outer_handlers = {
        number: signal.signal(number, record_signal) for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield received_signals
    finally:
        for number, handler in outer_handlers.items():
            signal.signal(number, handler)
