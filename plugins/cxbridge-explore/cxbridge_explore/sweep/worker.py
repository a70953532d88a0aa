"""A process that plays runs: it loads the scenario once and forks for each seed.

It exchanges frames of pickled objects with its parent over standard input and output. It receives a SweepJob,
then lists of seeds. It sends None after loading the scenario, then a row for each seed in order, or a
:class:`~cxbridge.errors.CxbridgeError` and ends.
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
from cxbridge_explore.sweep.frames import read_frame, write_frame
from cxbridge_explore.sweep.playing import play
from cxbridge_explore.sweep.rows import CRASHED, RunRow, SweepJob
from cxbridge_explore.worlds.points import ChoicePoint, Chooser, Option, RandomChooser, UsualChooser


class WorkerChannel:
    """A worker's connection to its parent.

    :param seeds: the stream with the job and the lists of seeds.
    :param rows: the stream for rows.
    """

    def __init__(self, seeds: IO[bytes], rows: IO[bytes]) -> None:
        self._seeds = seeds
        self._rows = rows

    def job(self) -> SweepJob:
        data = read_frame(self._seeds)
        assert data is not None
        job: SweepJob = pickle.loads(data)  # noqa: S301 - from our own parent
        return job

    def seeds(self) -> Iterator[int]:
        """Yield the seeds until the end of the stream."""
        while (data := read_frame(self._seeds)) is not None:
            yield from pickle.loads(data)  # noqa: S301 - from our own parent

    def send(self, answer: RunRow | CxbridgeError | None) -> None:
        """Send a row or an error; None after loading the scenario."""
        write_frame(self._rows, pickle.dumps(answer))


class ForkingSeeds:
    """A chooser that forks the process at its first choice: each child is the run of a seed.

    Loading the scenario, and everything before the first choice, happens only once.
    """

    def __init__(self, channel: WorkerChannel, job: SweepJob) -> None:
        self.seed: int | None = None  # seed of this child; None in the serving process
        self.started = 0.0
        self._channel = channel
        self._job = job
        self._chooser: Chooser = UsualChooser()
        self._row_end = -1

    def choose(self, index: int, point: ChoicePoint) -> int | Option:
        """Return the choice for this process's seed. The serving process never returns."""
        if self.seed is None:
            self._serve()
        return self._chooser.choose(index, point)

    def _serve(self) -> None:
        """Fork a child for each seed. Only the children return."""
        forking.limit_cpu_seconds(None)
        self._channel.send(None)
        gc.collect()
        gc.freeze()  # Keep existing objects shared with the children: no collection touches their pages.
        for seed in self._channel.seeds():
            reading, writing = os.pipe()
            child = forking.fork()
            if child == 0:
                os.close(reading)
                self._become(seed, writing)
                return
            os.close(writing)
            self._channel.send(_received(reading, child, seed))
        os._exit(0)

    def _become(self, seed: int, row_end: int) -> None:
        """Turn this child into the run of a seed."""
        forking.limit_cpu_seconds(self._job.cpu_seconds)
        self.seed, self._row_end = seed, row_end
        self.started = time.process_time()
        self._chooser = RandomChooser(seed)

    def finish(self, row: RunRow) -> None:
        """Send the row of this child to the serving process, and exit."""
        with os.fdopen(self._row_end, "wb") as pipe:
            pickle.dump(row, pipe)
        os._exit(0)


def _received(reading: int, child: int, seed: int) -> RunRow:
    """Return the row of a child, or a row about its death."""
    with os.fdopen(reading, "rb") as pipe:
        data = pipe.read()
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if status == 0 and data:
        row: RunRow = pickle.loads(data)  # noqa: S301 - from our own child
        return row
    ending = f"signal {-status}" if status < 0 else f"exit status {status}"
    return RunRow(seed, CRASHED, f"its process ended with {ending}")


def serve(channel: WorkerChannel) -> None:
    """Play runs until the end of the seeds."""
    job = channel.job()
    try:
        with file_errors():
            _play_all(channel, job)
    except CxbridgeError as error:
        channel.send(error)


def _play_all(channel: WorkerChannel, job: SweepJob) -> None:
    if forking.HAS_FORK:
        _serve_forking(channel, job)
    else:
        channel.send(None)
    for seed in channel.seeds():
        channel.send(play(job, seed, RandomChooser(seed)))


def _serve_forking(channel: WorkerChannel, job: SweepJob) -> None:
    """Play all seeds by forking; return after the last seed."""
    chooser = ForkingSeeds(channel, job)
    forking.limit_cpu_seconds(job.cpu_seconds)
    row = play(job, 0, chooser)
    if chooser.seed is not None:
        chooser.finish(replace(row, seed=chooser.seed, cpu_seconds=time.process_time() - chooser.started))
    forking.limit_cpu_seconds(None)
    channel.send(None)
    for seed in channel.seeds():  # The run has no choices, so all seeds give the same row.
        channel.send(replace(row, seed=seed, cpu_seconds=0.0))


def main() -> None:
    """Run a worker; the output of the runs goes to standard error."""
    rows = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    serve(WorkerChannel(sys.stdin.buffer, rows))


if __name__ == "__main__":
    main()
