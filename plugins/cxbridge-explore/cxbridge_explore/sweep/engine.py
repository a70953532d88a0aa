"""Plays the runs of a sweep in worker processes on this machine.

A thread for each worker takes chunks of seeds from a queue, and gives them to the worker. If a worker dies,
another worker gets its remaining seeds.
"""

from __future__ import annotations

import pickle
import queue
import subprocess
import threading
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from typing import Final

from cxbridge.closing import Closing
from cxbridge.errors import CxbridgeError
from cxbridge.spawning import python_command
from cxbridge_explore.sweep.rows import CRASHED, RunRow, SweepJob

MAX_DEATHS: Final = 3  # number of worker deaths after which a seed counts as crashed

_LOADING_KEY: Final = None  # in place of a seed, for deaths of workers that have not loaded the scenario

# The limit of seeds per chunk. With small chunks, all workers finish at about the same time.
_MAX_CHUNK_SEEDS: Final = 16


class WorkerDiedError(CxbridgeError):
    """A worker process ended before its work was done."""


class NotLoadedError(WorkerDiedError):
    """A worker process ended before loading the scenario."""


class WorkerProcess(Closing):
    """A process that plays runs; see :mod:`cxbridge_explore.sweep.worker`. Only one thread may use it.

    :param job: the common part of all runs.
    """

    def __init__(self, job: SweepJob) -> None:
        self._process = subprocess.Popen(  # noqa: S603 - starts our own module
            python_command("-m", "cxbridge_explore.sweep.worker"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        self._is_loaded = False
        self._send(job)

    @property
    def pid(self) -> int:
        return self._process.pid

    def play_seeds(self, seeds: Sequence[int]) -> Iterator[RunRow]:
        """Play the runs of some seeds, and yield their rows in order.

        :raises WorkerDiedError: if the process ends early.
        """
        self._send(list(seeds))
        assert self._process.stdout is not None
        row_count = 0
        while row_count < len(seeds):
            try:
                message = pickle.load(self._process.stdout)  # noqa: S301 - from our own child
            except (EOFError, pickle.UnpicklingError):
                raise self._make_death_error() from None
            if isinstance(message, CxbridgeError):
                raise message
            if message is None:  # the worker has loaded the scenario
                self._is_loaded = True
            else:
                row_count += 1
                yield message

    def _make_death_error(self) -> WorkerDiedError:
        status = self._process.wait()
        ending = f"signal {-status}" if status < 0 else f"exit status {status}"
        if self._is_loaded:
            return WorkerDiedError(f"worker {self.pid} ended with {ending}")
        return NotLoadedError(
            f"the scenario does not reach its first skill: its process ended with {ending}",
            hint="play it once with: cxbridge run",
        )

    def _send(self, message: object) -> None:
        assert self._process.stdin is not None
        with suppress(OSError):  # the process has ended, and reading its rows raises the error
            pickle.dump(message, self._process.stdin)
            self._process.stdin.flush()

    def kill(self) -> None:
        """Kill the process; called from any thread."""
        self._process.kill()

    def close(self) -> None:
        """Kill the process and release its streams."""
        self.kill()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                with suppress(OSError):
                    stream.close()
        self._process.wait()


class LocalEngine:
    """Plays runs in worker processes on this machine.

    :param jobs: the number of processes.
    """

    def __init__(self, jobs: int) -> None:
        self._jobs = jobs

    def play_seeds(self, job: SweepJob, seeds: Sequence[int]) -> Iterator[RunRow]:
        """Yield the row of each seed, in the order in which the runs end."""
        batch = _Batch(job, seeds, self._jobs)
        threads = [
            threading.Thread(target=batch.play_queued_seeds) for _ in range(min(self._jobs, len(seeds)))
        ]
        with ExitStack() as stack:
            for thread in threads:
                thread.start()
                stack.callback(thread.join)
            stack.callback(batch.stop)  # called before the threads are joined, so that they end
            for _ in seeds:
                result = batch.results.get()
                if isinstance(result, BaseException):
                    raise result
                yield result


class _Batch:
    """The seeds and results of one call of the engine, shared by threads with one worker each.

    :param jobs: the number of threads.
    """

    def __init__(self, job: SweepJob, seeds: Sequence[int], jobs: int) -> None:
        self.results: queue.SimpleQueue[RunRow | BaseException] = queue.SimpleQueue()
        self._job = job
        self._chunks: queue.SimpleQueue[list[int]] = queue.SimpleQueue()
        self._deaths: Counter[int | None] = Counter()  # by the seed that the worker played
        self._workers: set[WorkerProcess] = set()
        self._lock = threading.Lock()  # guards `_workers` and `_is_stopped`
        self._is_stopped = False
        chunk_size = max(1, min(_MAX_CHUNK_SEEDS, len(seeds) // (2 * jobs)))
        for start in range(0, len(seeds), chunk_size):
            self._chunks.put(list(seeds[start : start + chunk_size]))

    def play_queued_seeds(self) -> None:
        """Play queued seeds until the queue is empty. A new worker replaces a dead worker."""
        try:
            while not self._chunks.empty():
                with WorkerProcess(self._job) as worker, self._register(worker):
                    self._feed_worker(worker)
        except BaseException as error:  # noqa: BLE001 - the caller of play_seeds() raises the error
            self.results.put(error)

    @contextmanager
    def _register(self, worker: WorkerProcess) -> Iterator[None]:
        """Register a worker, so that :meth:`stop` kills it."""
        with self._lock:
            self._workers.add(worker)
            if self._is_stopped:  # stop() was called while the process started
                worker.kill()
        try:
            yield
        finally:
            with self._lock:
                self._workers.discard(worker)

    def _feed_worker(self, worker: WorkerProcess) -> None:
        """Give a worker queued seeds until the queue is empty or the worker dies."""
        while True:
            try:
                seeds = self._chunks.get_nowait()
            except queue.Empty:
                return
            try:
                for row in worker.play_seeds(tuple(seeds)):
                    seeds.remove(row.seed)
                    self.results.put(row)
            except WorkerDiedError as error:
                self._requeue_seeds(error, seeds)
                return

    def _requeue_seeds(self, error: WorkerDiedError, seeds: list[int]) -> None:
        """Return the remaining seeds of a dead worker to the queue."""
        # A worker plays its seeds in order, so that the first remaining seed has killed the worker.
        cause = _LOADING_KEY if isinstance(error, NotLoadedError) else seeds[0]
        self._deaths[cause] += 1
        if self._deaths[cause] >= MAX_DEATHS:
            if cause is _LOADING_KEY:
                raise error
            self.results.put(RunRow(seeds.pop(0), CRASHED, error.message))
        if seeds and not self._is_stopped:
            self._chunks.put(seeds)

    def stop(self) -> None:
        """Kill all workers and empty the queue."""
        with self._lock:
            self._is_stopped = True
            with suppress(queue.Empty):
                while True:
                    self._chunks.get_nowait()
            for worker in self._workers:
                worker.kill()
