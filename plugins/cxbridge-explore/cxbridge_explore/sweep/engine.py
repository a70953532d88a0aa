"""Engines: what plays the runs of a sweep, here or elsewhere."""

from __future__ import annotations

import pickle
import queue
import subprocess
import threading
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from typing import Final, Protocol

from cxbridge.closing import Closing
from cxbridge.errors import CxbridgeError
from cxbridge.process.python import python_command
from cxbridge_explore.sweep.frames import read_frame, write_frame
from cxbridge_explore.sweep.rows import CRASHED, RunRow, SweepJob

MOST_DEATHS: Final = 3
"""A seed with which this many workers died has crashed."""

_LOADING: Final = None
"""What workers died of that had not begun with any seed."""

_CHUNK: Final = 16
"""Seeds that a worker gets at once: few enough that little is lost with it, and that all end together."""


class Engine(Protocol):
    """Plays runs somewhere."""

    def rows(self, job: SweepJob, seeds: Sequence[int]) -> Iterator[RunRow]:
        """Yield a row for each seed, in any order.

        :raises CxbridgeError: when the scenario is wrong.
        """

    def close(self) -> None:
        """Let go of everything."""


class WorkerDiedError(CxbridgeError):
    """A worker's process ended before its work was done."""


class NotLoadedError(WorkerDiedError):
    """A worker's process ended before it had loaded the scenario."""


class WorkerProcess(Closing):
    """A process that plays the runs of a job, see :mod:`cxbridge_explore.sweep.worker`. For one thread.

    :param job: what all its runs have in common.
    """

    def __init__(self, job: SweepJob) -> None:
        self._process = subprocess.Popen(  # noqa: S603 - ourselves
            python_command("-m", "cxbridge_explore.sweep.worker"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        self._is_loaded = False
        self._send(job)

    @property
    def pid(self) -> int:
        """Its number."""
        return self._process.pid

    def rows(self, seeds: Sequence[int]) -> Iterator[RunRow]:
        """Yield the rows of these seeds, in order.

        :raises CxbridgeError: when the scenario is wrong.
        :raises WorkerDiedError: when the process ends before.
        """
        self._send(list(seeds))
        assert self._process.stdout is not None
        left = len(seeds)
        while left:
            data = read_frame(self._process.stdout)
            if data is None:
                raise self._died()
            answer = pickle.loads(data)  # noqa: S301 - from our own child
            if isinstance(answer, CxbridgeError):
                raise answer
            if answer is None:
                self._is_loaded = True
            else:
                left -= 1
                yield answer

    def _died(self) -> WorkerDiedError:
        """Return the meaning of the process' end."""
        status = self._process.wait()
        how = f"signal {-status}" if status < 0 else f"exit status {status}"
        if self._is_loaded:
            return WorkerDiedError(f"worker {self.pid} ended with {how}")
        return NotLoadedError(
            f"the scenario does not come to its first skill: its process ended with {how}",
            hint="play it once with: cxbridge run",
        )

    def _send(self, message: object) -> None:
        assert self._process.stdin is not None
        with suppress(OSError):  # it is gone: its answer will not come either
            write_frame(self._process.stdin, pickle.dumps(message))

    def kill(self) -> None:
        """End the process. From any thread."""
        self._process.kill()

    def close(self) -> None:
        """End the process, and let go of it."""
        self.kill()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                with suppress(OSError):
                    stream.close()
        self._process.wait()


class LocalEngine(Closing):
    """Plays runs in processes of this machine.

    A worker that dies is replaced; its unanswered seeds go to other workers.

    :param jobs: how many processes.
    """

    def __init__(self, jobs: int) -> None:
        self._jobs = jobs

    def rows(self, job: SweepJob, seeds: Sequence[int]) -> Iterator[RunRow]:
        """Yield the row of each seed; see :class:`Engine`."""
        batch = _Batch(job, seeds, self._jobs)
        threads = [threading.Thread(target=batch.work) for _ in range(min(self._jobs, len(seeds)))]
        with ExitStack() as stack:
            for thread in threads:
                thread.start()
                stack.callback(thread.join)
            stack.callback(batch.stop)
            for _ in seeds:
                answer = batch.answers.get()
                if isinstance(answer, BaseException):
                    raise answer
                yield answer

    def close(self) -> None:
        """Do nothing: what plays ends with its rows."""


class _Batch:
    """The runs of one job, shared by threads that have a worker each.

    :param jobs: how many threads.
    """

    def __init__(self, job: SweepJob, seeds: Sequence[int], jobs: int) -> None:
        self.answers: queue.SimpleQueue[RunRow | BaseException] = queue.SimpleQueue()
        self._job = job
        self._waiting: queue.SimpleQueue[list[int]] = queue.SimpleQueue()
        self._deaths: Counter[int | None] = Counter()
        self._workers: set[WorkerProcess] = set()
        self._lock = threading.Lock()
        self._stopped = False
        size = max(1, min(_CHUNK, len(seeds) // (2 * jobs)))
        for start in range(0, len(seeds), size):
            self._waiting.put(list(seeds[start : start + size]))

    def work(self) -> None:
        """Let one worker after the other play what waits, until nothing does."""
        try:
            while not self._waiting.empty():
                with WorkerProcess(self._job) as worker, self._known(worker):
                    self._feed(worker)
        except BaseException as error:  # noqa: BLE001 - it belongs to who asked for the rows
            self.answers.put(error)

    @contextmanager
    def _known(self, worker: WorkerProcess) -> Iterator[None]:
        """Let a worker be stopped during the wait."""
        with self._lock:
            self._workers.add(worker)
            if self._stopped:
                worker.kill()
        try:
            yield
        finally:
            with self._lock:
                self._workers.discard(worker)

    def _feed(self, worker: WorkerProcess) -> None:
        """Give a worker what waits, until nothing does or it dies."""
        while True:
            try:
                left = self._waiting.get_nowait()
            except queue.Empty:
                return
            try:
                for row in worker.rows(tuple(left)):
                    left.remove(row.seed)
                    self.answers.put(row)
            except WorkerDiedError as error:
                self._bury(error, left)
                return

    def _bury(self, error: WorkerDiedError, left: list[int]) -> None:
        """Give the seeds of a dead worker to other workers.

        :raises NotLoadedError: when all workers die before they have begun.
        """
        cause = _LOADING if isinstance(error, NotLoadedError) else left[0]
        self._deaths[cause] += 1
        if self._deaths[cause] >= MOST_DEATHS:
            if cause is _LOADING:
                raise error
            self.answers.put(RunRow(left.pop(0), CRASHED, error.message))
        if left and not self._stopped:
            self._waiting.put(left)

    def stop(self) -> None:
        """Play no more."""
        with self._lock:
            self._stopped = True
            with suppress(queue.Empty):
                while True:
                    self._waiting.get_nowait()
            for worker in self._workers:
                worker.kill()
