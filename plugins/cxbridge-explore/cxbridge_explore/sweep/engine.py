"""Plays the runs of a sweep in worker processes on this machine.

A worker gets chunks of seeds. If a worker dies, another worker gets its remaining seeds.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, suppress
from multiprocessing import Pipe
from multiprocessing.connection import wait
from typing import Final

from cxbridge.closing import Closing
from cxbridge.errors import CxbridgeError
from cxbridge_explore.spawning import describe_exit, start_safe_process
from cxbridge_explore.sweep.rows import CRASHED, RunRow, SweepJob
from cxbridge_explore.sweep.worker import run_worker

# The number of worker deaths after which a seed counts as crashed, as for an edge of an exploration. A death
# may have another cause than the seed.
MAX_DEATHS: Final = 3

_LOADING_KEY: Final = None  # in place of a seed, for deaths of workers that have not loaded the scenario

# The limit of seeds per chunk. With small chunks, all workers finish at about the same time.
_MAX_CHUNK_SEEDS: Final = 16


class WorkerProcess(Closing):
    """A process that plays runs; see :mod:`cxbridge_explore.sweep.worker`.

    :param job: the common part of all runs.
    :ivar seeds: the seeds whose rows the worker has not sent yet, in order.
    :ivar is_loaded: whether the worker has loaded the scenario.
    """

    def __init__(self, job: SweepJob) -> None:
        self.connection, worker_end = Pipe()
        with worker_end:
            self.process = start_safe_process(run_worker, worker_end, job)
        self.seeds: list[int] = []
        self.is_loaded = False

    def give_seeds(self, seeds: list[int]) -> None:
        """Let the worker play the runs of some seeds."""
        self.seeds = seeds
        with suppress(OSError):  # the worker has died, and reading its rows raises the error
            self.connection.send(seeds)

    def close(self) -> None:
        """Kill the process and release its resources."""
        self.process.kill()
        self.process.join()
        self.connection.close()


def play_seeds(job: SweepJob, seeds: Sequence[int], process_count: int) -> Iterator[RunRow]:
    """Yield the row of each seed, in the order in which the runs end.

    :param job: the common part of all runs.
    :raises CxbridgeError: if the scenario or the world is invalid, or does not load.
    """
    # at least two chunks for each worker, if there are enough seeds
    chunk_size = max(1, min(_MAX_CHUNK_SEEDS, len(seeds) // (2 * process_count)))
    starts = range(0, len(seeds), chunk_size)
    chunks = deque(list(seeds[start : start + chunk_size]) for start in starts)
    deaths: Counter[int | None] = Counter()  # by the seed that the worker played
    workers: list[WorkerProcess] = []
    with ExitStack() as stack:
        while chunks or any(worker.seeds for worker in workers):
            while chunks and len(workers) < process_count:
                workers.append(stack.enter_context(WorkerProcess(job)))
                workers[-1].give_seeds(chunks.popleft())
            ready_connections = wait([worker.connection for worker in workers])
            # a copy of the list, since dead workers are removed from it
            for worker in [worker for worker in workers if worker.connection in ready_connections]:
                try:
                    message = worker.connection.recv()
                except (EOFError, OSError):
                    workers.remove(worker)
                    if worker.seeds:  # a worker without seeds is not replaced
                        yield from _handle_death(worker, deaths)
                    if worker.seeds:  # without the seed that has killed too many workers
                        chunks.append(worker.seeds)
                    continue
                if isinstance(message, CxbridgeError):
                    raise message
                if message is None:
                    worker.is_loaded = True
                else:
                    worker.seeds.remove(message.seed)
                    if chunks and not worker.seeds:
                        worker.give_seeds(chunks.popleft())
                    yield message


def _handle_death(worker: WorkerProcess, deaths: Counter[int | None]) -> Iterator[RunRow]:
    """Count the death of a worker with seeds; yield the row of a seed that has killed too many workers.

    :param deaths: the number of deaths so far by the seed that the worker played.
    :raises CxbridgeError: if too many workers have died before they had loaded the scenario.
    """
    worker.process.join()
    ending = describe_exit(worker.process.exitcode)
    # A worker plays its seeds in order, so it died while it played the first remaining seed.
    cause = worker.seeds[0] if worker.is_loaded else _LOADING_KEY
    deaths[cause] += 1
    if deaths[cause] < MAX_DEATHS:
        return
    if cause is _LOADING_KEY:
        raise CxbridgeError(
            f"the scenario does not reach its first skill: its process ended with {ending}",
            hint="play it once with: cxbridge run",
        )
    yield RunRow(worker.seeds.pop(0), CRASHED, f"worker {worker.process.pid} ended with {ending}")
