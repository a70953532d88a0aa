"""The worker process of a sweep, which loads the scenario once, and forks a child for the run of each seed.

The worker receives lists of seeds from its parent. It sends None when it has loaded the scenario and played
up to the first choice, or to the end of a run without choices, then a row for each seed in order; or it sends
a :class:`~cxbridge.errors.CxbridgeError` and ends. On a system that cannot fork, the worker sends None at
once, and loads the scenario for each seed.
"""

from __future__ import annotations

import gc
import os
import signal
import time
from collections.abc import Iterator
from dataclasses import replace
from multiprocessing import Pipe
from multiprocessing.connection import Connection

from cxbridge.errors import CxbridgeError
from cxbridge.file_access import file_errors
from cxbridge_explore import forking
from cxbridge_explore.spawning import describe_exit
from cxbridge_explore.sweep.playing import play_seed
from cxbridge_explore.sweep.rows import CRASHED, RunRow, SweepJob
from cxbridge_explore.worlds.points import ChoicePoint, Chooser, Option, RandomChooser


def receive_seeds(connection: Connection) -> Iterator[int]:
    """Yield the seeds until the parent closes the connection."""
    while True:
        try:
            yield from connection.recv()
        except EOFError:
            return


class SeedForkChooser:
    """A chooser that forks a child for each seed at the first choice of the run.

    Loading the scenario and playing up to the first choice thus happen only once.

    :param connection: the connection to the parent of the worker.
    :ivar seed: the seed of this child; None in the worker.
    """

    def __init__(self, connection: Connection, job: SweepJob) -> None:
        self.seed: int | None = None
        self._connection, self._job = connection, job
        self._chooser: Chooser  # of this child
        self._start_cpu_s = 0.0  # processor time of this child at the fork

    def choose(self, point: ChoicePoint) -> int | Option:
        """Return the choice of this child's seed. In the worker, the method never returns."""
        if self.seed is None:
            self._serve_seeds()
        return self._chooser.choose(point)

    def _serve_seeds(self) -> None:
        """Fork a child for each seed. Only the children return."""
        forking.limit_cpu_seconds(None)  # each child gets its own limit
        self._connection.send(None)
        gc.collect()
        gc.freeze()  # later collections skip the present objects, whose memory pages the children share
        for seed in receive_seeds(self._connection):
            row_receiver, self._row_sender = Pipe(duplex=False)  # from the child to the worker
            child_pid = forking.fork()
            if child_pid == 0:
                self._become_run(seed)
                return
            self._row_sender.close()  # so that the pipe ends when the child ends
            with row_receiver:
                try:
                    row = row_receiver.recv()
                except EOFError:  # the child has died
                    row = None
            _, wait_status = os.waitpid(child_pid, 0)
            status = os.waitstatus_to_exitcode(wait_status)
            self._connection.send(
                row or RunRow(seed, CRASHED, f"its process ended with {describe_exit(status)}")
            )
        os._exit(0)  # the run of the worker itself has no seed, and ends here

    def _become_run(self, seed: int) -> None:
        """Turn this child into the run of a seed."""
        forking.limit_cpu_seconds(self._job.cpu_limit_s)
        self.seed = seed
        self._start_cpu_s = time.process_time()
        self._chooser = RandomChooser(seed)

    def send_row(self, row: RunRow) -> None:
        """Send the row of this child to the worker, and exit."""
        assert self.seed is not None
        cpu_seconds = time.process_time() - self._start_cpu_s
        self._row_sender.send(replace(row, seed=self.seed, cpu_seconds=cpu_seconds))
        os._exit(0)  # without cleanup, since the worker shares the resources of this child


def run_worker(connection: Connection, job: SweepJob) -> None:
    """Play the runs of all seeds that the parent sends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent, which Ctrl-C reaches too, kills the worker
    os.dup2(2, 1)  # the standard output has only the result of the sweep, and not the output of the runs
    try:
        with file_errors():
            if forking.HAS_FORK:
                _serve_forking(connection, job)
                return
            connection.send(None)
            for seed in receive_seeds(connection):
                connection.send(play_seed(job, seed, RandomChooser(seed)))
    except CxbridgeError as error:
        connection.send(error)


def _serve_forking(connection: Connection, job: SweepJob) -> None:
    """Play the runs of all seeds in forked children."""
    chooser = SeedForkChooser(connection, job)
    # An agent that never reaches its first choice must not block the sweep.
    forking.limit_cpu_seconds(job.cpu_limit_s)
    row = play_seed(job, 0, chooser)  # each copy of the row gets its own seed
    if chooser.seed is not None:
        chooser.send_row(row)
    forking.limit_cpu_seconds(None)
    connection.send(None)
    # The run has ended without a choice, so that all seeds have the same row.
    for seed in receive_seeds(connection):
        connection.send(replace(row, seed=seed, cpu_seconds=0.0))
