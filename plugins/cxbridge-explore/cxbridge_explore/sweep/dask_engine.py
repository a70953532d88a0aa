"""Plays the runs of a sweep on a Dask cluster."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import Any, Final

from cxbridge.closing import Closing
from cxbridge.errors import CxbridgeError
from cxbridge.extras import install_command
from cxbridge_explore.sweep.engine import MAX_DEATHS, NotLoadedError, WorkerDiedError
from cxbridge_explore.sweep.parcel import pack_job, play_parcel
from cxbridge_explore.sweep.rows import CRASHED, RunRow, SweepJob

# Seeds per task. A run takes about 80 ms, compared to which the scheduler's millisecond per task is small.
_CHUNK_SEEDS: Final = 32
_CONNECT_TIMEOUT_S: Final = 30


class DaskEngine(Closing):
    """Plays runs on the workers of a Dask scheduler, which get the files of the agent with the job.

    If a worker dies, Dask gives the work to another worker.

    :param address: ``HOST:PORT`` of the scheduler.
    :raises CxbridgeError: if the scheduler does not reply, or distributed is not installed.
    """

    def __init__(self, address: str) -> None:
        try:
            self._dask: Any = import_module("distributed")  # the package has no types
        except ModuleNotFoundError as error:
            raise CxbridgeError(
                f"--engine dask:// needs the package '{error.name}'",
                hint=install_command("dask", "cxbridge-explore"),
            ) from None
        try:
            self._client: Any = self._dask.Client(f"tcp://{address}", timeout=_CONNECT_TIMEOUT_S)
        except (OSError, ValueError) as error:
            raise CxbridgeError(
                f"no Dask scheduler replies at {address}: {error}", hint="start a scheduler: dask scheduler"
            ) from error

    def play_seeds(self, job: SweepJob, seeds: Sequence[int]) -> Iterator[RunRow]:
        """Yield the row of each seed, in the order in which the runs end."""
        parcel = self._client.scatter(pack_job(job), broadcast=True)
        chunks = [list(seeds[start : start + _CHUNK_SEEDS]) for start in range(0, len(seeds), _CHUNK_SEEDS)]
        pending_chunks = {self._submit(parcel, chunk): chunk for chunk in chunks}
        completed = self._dask.as_completed(list(pending_chunks))
        for future in completed:
            chunk = pending_chunks.pop(future)
            for row in self._receive_rows(future, chunk):
                chunk.remove(row.seed)
                yield row
            # The first remaining seed has killed its process, and is retried in a task without further seeds.
            for seeds_of_task in (chunk[:1], chunk[1:]):
                if seeds_of_task:
                    task = self._submit(parcel, seeds_of_task)
                    pending_chunks[task] = seeds_of_task
                    completed.add(task)

    def _receive_rows(self, future: Any, chunk: list[int]) -> list[RunRow]:
        """Return the rows of a task, or the rows before the death of its process; there may be none."""
        error = future.exception()
        if error is None:
            rows: list[RunRow] = future.result()
            return rows
        # `NotLoadedError` is an error of the sweep, since a scenario that does not load kills each worker
        is_death = isinstance(error, self._dask.scheduler.KilledWorker | WorkerDiedError)
        if is_death and not isinstance(error, NotLoadedError):
            return [RunRow(chunk[0], CRASHED, str(error))] if len(chunk) == 1 else []
        raise error if isinstance(error, CxbridgeError) else CxbridgeError(f"Dask: {error}") from error

    def _submit(self, parcel: Any, chunk: list[int]) -> Any:
        # not pure, since Dask would return the first result for a second task with the same arguments
        return self._client.submit(play_parcel, parcel, list(chunk), retries=MAX_DEATHS, pure=False)

    def close(self) -> None:
        """Disconnect from the scheduler; unfinished work is dropped."""
        self._client.close()
