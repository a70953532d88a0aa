"""The worker process of a sweep, which loads the scenario once, and forks a child for the run of each seed.

The worker exchanges pickled objects with its parent over standard input and output. The worker receives a
SweepJob, and then lists of seeds. It sends None after loading the scenario, then a row for each seed in
order; or it sends a :class:`~cxbridge.errors.CxbridgeError` and ends.
"""

from __future__ import annotations

import gc
import os
import pickle
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import IO

from cxbridge.errors import CxbridgeError
from cxbridge.file_access import file_errors
from cxbridge_explore import forking
from cxbridge_explore.sweep.playing import play_seed
from cxbridge_explore.sweep.rows import CRASHED, RunRow, SweepJob
from cxbridge_explore.worlds.points import ChoicePoint, Chooser, Option, RandomChooser, UsualChooser


class ParentConnection:
    """The connection of a worker to its parent.

    :param requests: the stream with the job and the lists of seeds.
    :param rows: the stream for rows.
    """

    def __init__(self, requests: IO[bytes], rows: IO[bytes]) -> None:
        self._requests, self._rows = requests, rows
        self.job: SweepJob = pickle.load(requests)  # noqa: S301 - from our own parent

    def receive_seeds(self) -> Iterator[int]:
        """Yield the seeds until the end of the stream."""
        while True:
            try:
                seeds: list[int] = pickle.load(self._requests)  # noqa: S301 - from our own parent
            except EOFError:
                return
            yield from seeds

    def send(self, message: RunRow | CxbridgeError | None) -> None:
        """Send a row or an error, or None after loading the scenario."""
        pickle.dump(message, self._rows)
        self._rows.flush()


class SeedForkChooser:
    """A chooser that forks a child for each seed at the first choice of the run.

    So the scenario is loaded, and the run is played up to its first choice, only once.

    :ivar seed: the seed of this child; None in the worker.
    """

    def __init__(self, parent: ParentConnection) -> None:
        self.seed: int | None = None
        self._parent = parent
        self._chooser: Chooser = UsualChooser()  # replaced in each child
        self._row_pipe = -1  # descriptor of this child's pipe to the worker
        self._start_cpu_s = 0.0  # processor time of this child at the fork

    def choose(self, index: int, point: ChoicePoint) -> int | Option:
        """Return the choice of this child's seed. In the worker, the method never returns."""
        if self.seed is None:
            self._serve_seeds()
        return self._chooser.choose(index, point)

    def _serve_seeds(self) -> None:
        """Fork a child for each seed. Only the children return."""
        forking.limit_cpu_seconds(None)
        self._parent.send(None)
        gc.collect()
        gc.freeze()  # later collections skip the present objects, whose memory pages the children share
        for seed in self._parent.receive_seeds():
            reading, writing = os.pipe()
            child_pid = forking.fork()
            if child_pid == 0:
                os.close(reading)
                self._become_run(seed, writing)
                return
            # closed, so that the pipe ends when the child ends
            os.close(writing)
            self._parent.send(_receive_row(reading, child_pid, seed))
        os._exit(0)

    def _become_run(self, seed: int, row_pipe: int) -> None:
        """Turn this child into the run of a seed."""
        forking.limit_cpu_seconds(self._parent.job.cpu_seconds)
        self.seed, self._row_pipe = seed, row_pipe
        self._start_cpu_s = time.process_time()
        self._chooser = RandomChooser(seed)

    def send_row(self, row: RunRow) -> None:
        """Send the row of this child to the worker, and exit."""
        assert self.seed is not None
        row = replace(row, seed=self.seed, cpu_seconds=time.process_time() - self._start_cpu_s)
        with os.fdopen(self._row_pipe, "wb") as pipe:
            pickle.dump(row, pipe)
        os._exit(0)  # without cleanup, since the worker shares the resources of this child


def _receive_row(reading: int, child_pid: int, seed: int) -> RunRow:
    """Return the row of a child, or a row that reports its death."""
    with os.fdopen(reading, "rb") as pipe:
        data = pipe.read()
    status = os.waitstatus_to_exitcode(os.waitpid(child_pid, 0)[1])
    if status == 0 and data:
        row: RunRow = pickle.loads(data)  # noqa: S301 - from our own child
        return row
    ending = f"signal {-status}" if status < 0 else f"exit status {status}"
    return RunRow(seed, CRASHED, f"its process ended with {ending}")


def serve(parent: ParentConnection) -> None:
    """Play the runs of all seeds that the parent sends."""
    try:
        with file_errors():
            if forking.HAS_FORK:
                _serve_forking(parent)
                return
            parent.send(None)
            for seed in parent.receive_seeds():
                parent.send(play_seed(parent.job, seed, RandomChooser(seed)))
    except CxbridgeError as error:
        parent.send(error)


def _serve_forking(parent: ParentConnection) -> None:
    """Play the runs of all seeds in forked children."""
    chooser = SeedForkChooser(parent)
    # An agent that never reaches its first choice must not block the sweep.
    forking.limit_cpu_seconds(parent.job.cpu_seconds)
    row = play_seed(parent.job, 0, chooser)
    if chooser.seed is not None:
        chooser.send_row(row)
    forking.limit_cpu_seconds(None)
    parent.send(None)
    # The run has ended without a choice, so that all seeds have the same row.
    for seed in parent.receive_seeds():
        parent.send(replace(row, seed=seed, cpu_seconds=0.0))


def main() -> None:
    """Run a worker."""
    # The rows go to the original standard output, and output of the runs goes to standard error.
    rows = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    serve(ParentConnection(sys.stdin.buffer, rows))


if __name__ == "__main__":
    main()
