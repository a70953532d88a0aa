"""Explores a scenario: plays every way that its runs can go, within bounds."""

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
from cxbridge_explore.checkpoint import identity_of, read_checkpoint
from cxbridge_explore.coordinator import Coordinator
from cxbridge_explore.determinism import UsualRun, explain_difference, usual_moments
from cxbridge_explore.graph import Graph
from cxbridge_explore.judging import properties_of
from cxbridge_explore.playing import ExploredRun
from cxbridge_explore.progress import ProgressReporter
from cxbridge_explore.properties.monitor import Property
from cxbridge_explore.replaying import explore_by_replay
from cxbridge_explore.result import ExploreResult
from cxbridge_explore.worker import serve
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
    make: MakeAssembly = make_scenario,
    resume: Path | None = None,
    show: Callable[[str], None] | None = None,
    draw: Callable[[ExploreResult], None] | None = None,
) -> ExploreResult:
    """Explore until no edge is open, or a signal requests the end.

    The calling process must have no other threads, since it is forked.

    :param options: the options of ``cxbridge run``.
    :param properties: the properties of every run; None for the built-in properties and the properties in the
        scenario's folder.
    :param world: the possible events; None for the file in the scenario's folder.
    :param make: makes the program to run.
    :param resume: the checkpoint of an interrupted exploration.
    :param show: called with a line of progress from time to time.
    :param draw: called every few seconds with the result so far.
    :raises CxbridgeError: if the scenario or an option is invalid, or the agent is not deterministic.
    """
    options.check()
    properties = properties_of(options) if properties is None else properties
    bounds.check()
    execution.check()
    make_explored_run = partial(
        ExploredRun, options, properties, world=world, make=make, coverage=execution.coverage
    )
    graph = Graph(bounds.faults, bounds.depth)
    if resume is not None:
        read_checkpoint(resume, graph, identity_of(options, bounds, properties, world, make))
    coordinator: Coordinator | None = None
    unmerged_reasons: tuple[str, ...] = ()
    started, cpu_s = time.perf_counter(), _cpu_seconds()

    def draw_so_far(explored_graph: Graph) -> None:
        if draw is not None:
            draw(ExploreResult(explored_graph, tuple(properties), (), 0.0, time.perf_counter() - started))

    progress = ProgressReporter(graph, show, None if draw is None else draw_so_far)
    # The second usual run is played at the same time, in a process that is forked before all other processes.
    with _signals() as received, closing(UsualRun(make_explored_run)) as usual:

        def is_over() -> bool:
            progress.tick()
            return bool(received)

        def load(address: str) -> NoReturn:
            serve(address, make_explored_run, merge=bounds.merge)

        try:
            if execution.forks:
                with Coordinator(graph, execution, load) as coordinator:
                    coordinator.explore(is_over)
            else:
                unmerged_reasons = explore_by_replay(make_explored_run, graph, is_over, merge=bounds.merge)
            if not received:
                _check_determinism(graph, usual)
        except DivergedError as error:
            raise explain_difference(make_explored_run, error) from None
    cpu_s = _cpu_seconds() - cpu_s
    if coordinator is not None:
        unmerged_reasons = tuple(coordinator.unmerged_reasons)
        cpu_s += coordinator.cpu_seconds
    return ExploreResult(graph, tuple(properties), unmerged_reasons, cpu_s, time.perf_counter() - started)


def _check_determinism(graph: Graph, usual: UsualRun) -> None:
    """Compare the usual run of the exploration with another usual run."""
    explored = usual_moments(graph)
    if explored is not None and usual.moments() not in (None, explored):
        raise DivergedError("two usual runs differ")


def _cpu_seconds() -> float:
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


@contextmanager
def _signals() -> Iterator[list[int]]:
    """Record the signals that request the end, without a thread, since this process forks."""
    received: list[int] = []

    def note(number: int, _frame: object) -> None:
        if received:
            signal.default_int_handler(number, None)  # the second signal ends the process at once
        received.append(number)

    outer_handlers = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield received
    finally:
        for number, handler in outer_handlers.items():
            signal.signal(number, handler)
