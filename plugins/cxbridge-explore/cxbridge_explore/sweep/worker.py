"""A process that plays runs: it loads the scenario once and forks for each seed.

The process exchanges pickled objects with its parent over standard input and output. It receives a SweepJob,
then lists of seeds. It sends None after loading the scenario, then a row for each seed in order; or it sends
a :class:`~cxbridge.errors.CxbridgeError` and ends.
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
from cxbridge_explore.sweep.playing import play
from cxbridge_explore.sweep.rows import CRASHED, RunRow, SweepJob
from cxbridge_explore.worlds.points import ChoicePoint, Chooser, Option, RandomChooser, UsualChooser


class ParentConnection:
    """A worker's connection to its parent.

    :param requests: the stream with the job and the lists of seeds.
    :param rows: the stream for rows.
    """

    def __init__(self, requests: IO[bytes], rows: IO[bytes]) -> None:
        self._requests, self._rows = requests, rows
        self.job: SweepJob = pickle.load(requests)  # noqa: S301 - from our own parent

    def seeds(self) -> Iterator[int]:
        """Yield the seeds until the end of the stream."""
        while True:
            try:
                seeds: list[int] = pickle.load(self._requests)  # noqa: S301 - from our own parent
            except EOFError:
                return
            yield from seeds

    def send(self, message: RunRow | CxbridgeError | None) -> None:
        """Send a row or an error; None after loading the scenario."""
        pickle.dump(message, self._rows)
        self._rows.flush()


class SeedForkChooser:
    """A chooser that forks the process at its first choice: each child is the run of a seed.

    Loading the scenario, and everything before the first choice, happens only once.
    """

    def __init__(self, parent: ParentConnection) -> None:
        self.seed: int | None = None  # seed of this child; None in the serving process
        self._parent = parent
        self._chooser: Chooser = UsualChooser()
        self._row_end = -1  # descriptor of this child's pipe to the serving process
        self._start_s = 0.0  # processor time of the process at the fork

    def choose(self, index: int, point: ChoicePoint) -> int | Option:
        """Return the choice for this process's seed. The serving process never returns."""
        if self.seed is None:
            self._serve()
        return self._chooser.choose(index, point)

    def _serve(self) -> None:
        """Fork a child for each seed. Only the children return."""
        forking.limit_cpu_seconds(None)
        self._parent.send(None)
        gc.collect()
        gc.freeze()  # Keep existing objects shared with the children: no collection touches their pages.
        for seed in self._parent.seeds():
            reading, writing = os.pipe()
            child = forking.fork()
            if child == 0:
                os.close(reading)
                self._become(seed, writing)
                return
            # The pipe ends with the child only if the serving process has closed the writing end.
            os.close(writing)
            self._parent.send(_receive_row(reading, child, seed))
        os._exit(0)

    def _become(self, seed: int, row_end: int) -> None:
        """Turn this child into the run of a seed."""
        forking.limit_cpu_seconds(self._parent.job.cpu_seconds)
        self.seed, self._row_end = seed, row_end
        self._start_s = time.process_time()
        self._chooser = RandomChooser(seed)

    def finish(self, row: RunRow) -> None:
        """Send the row of this child to the serving process, and exit."""
        assert self.seed is not None
        row = replace(row, seed=self.seed, cpu_seconds=time.process_time() - self._start_s)
        with os.fdopen(self._row_end, "wb") as pipe:
            pickle.dump(row, pipe)
        os._exit(0)  # without cleanup: the resources are shared with the serving process


def _receive_row(reading: int, child: int, seed: int) -> RunRow:
    """Return the row of a child, or a row about its death."""
    with os.fdopen(reading, "rb") as pipe:
        data = pipe.read()
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if status == 0 and data:
        row: RunRow = pickle.loads(data)  # noqa: S301 - from our own child
        return row
    ending = f"signal {-status}" if status < 0 else f"exit status {status}"
    return RunRow(seed, CRASHED, f"its process ended with {ending}")


def serve(parent: ParentConnection) -> None:
    """Play runs until the end of the seeds."""
    try:
        with file_errors():
            if forking.HAS_FORK:
                _serve_forking(parent)
                return
            parent.send(None)
            for seed in parent.seeds():
                parent.send(play(parent.job, seed, RandomChooser(seed)))
    except CxbridgeError as error:
        parent.send(error)


def _serve_forking(parent: ParentConnection) -> None:
    """Play all seeds by forking; return after the last seed."""
    chooser = SeedForkChooser(parent)
    # An agent that never reaches its first choice must not block the sweep.
    forking.limit_cpu_seconds(parent.job.cpu_seconds)
    row = play(parent.job, 0, chooser)
    if chooser.seed is not None:
        chooser.finish(row)
    forking.limit_cpu_seconds(None)
    parent.send(None)
    for seed in parent.seeds():  # The run has no choices, so all seeds give the same row.
        parent.send(replace(row, seed=seed, cpu_seconds=0.0))


def main() -> None:
    """Run a worker; the output of the runs goes to standard error."""
    rows = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    serve(ParentConnection(sys.stdin.buffer, rows))


if __name__ == "__main__":
    main()
