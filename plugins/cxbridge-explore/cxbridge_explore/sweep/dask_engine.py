"""Plays the runs of a sweep on a Dask cluster."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import Any, Final

from cxbridge.closing import Closing
from cxbridge.errors import CxbridgeError
from cxbridge.extras import install_command
from cxbridge_explore.sweep.engine import MAX_DEATHS, NotLoadedError, WorkerDiedError
from cxbridge_explore.sweep.parcel import pack, play_parcel
from cxbridge_explore.sweep.rows import CRASHED, RunRow, SweepJob

# Seeds per task. Dask's scheduler takes up to a millisecond per task, and a run about 80 ms.
_CHUNK: Final = 32
_TIMEOUT_S: Final = 30  # limit for connecting to the scheduler


class DaskEngine(Closing):
    """Plays runs on the workers of a Dask scheduler. The files of the agent travel with the job.

    If a worker dies, Dask gives its work to another worker.

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
            self._client: Any = self._dask.Client(f"tcp://{address}", timeout=_TIMEOUT_S)
        except (OSError, ValueError) as error:
            raise CxbridgeError(
                f"no Dask scheduler answers at {address}: {error}", hint="start a scheduler: dask scheduler"
            ) from error

    def rows(self, job: SweepJob, seeds: Sequence[int]) -> Iterator[RunRow]:
        """Yield the row of each seed, in the order in which the runs end."""
        parcel = self._client.scatter(pack(job), broadcast=True)
        chunks = [list(seeds[start : start + _CHUNK]) for start in range(0, len(seeds), _CHUNK)]
        pending = {self._submit(parcel, chunk): chunk for chunk in chunks}
        completed = self._dask.as_completed(list(pending))
        for future in completed:
            chunk = pending.pop(future)
            for row in self._result(future, chunk):
                chunk.remove(row.seed)
                yield row
            # The first remaining seed killed its process, so it is retried alone.
            for seeds_of_task in (chunk[:1], chunk[1:]):
                if seeds_of_task:
                    task = self._submit(parcel, seeds_of_task)
                    pending[task] = seeds_of_task
                    completed.add(task)

    def _result(self, future: Any, chunk: list[int]) -> list[RunRow]:
        """Return the rows of a task: those before the death of its process, none if it died at once."""
        error = future.exception()
        if error is None:
            rows: list[RunRow] = future.result()
            return rows
        # a scenario that does not load kills each worker, so this is an error of the sweep, not of a seed
        is_death = isinstance(error, self._dask.scheduler.KilledWorker | WorkerDiedError)
        if is_death and not isinstance(error, NotLoadedError):
            return [RunRow(chunk[0], CRASHED, str(error))] if len(chunk) == 1 else []
        raise error if isinstance(error, CxbridgeError) else CxbridgeError(f"Dask: {error}") from error

    def _submit(self, parcel: Any, chunk: list[int]) -> Any:
        # A pure task with the same arguments would return the result of its first attempt.
        return self._client.submit(play_parcel, parcel, list(chunk), retries=MAX_DEATHS, pure=False)

    def close(self) -> None:
        """Disconnect from the scheduler; unfinished work is dropped."""
        self._client.close()
