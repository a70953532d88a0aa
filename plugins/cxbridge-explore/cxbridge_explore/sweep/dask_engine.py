"""Plays the runs of a sweep on a Dask cluster."""

from __future__ import annotations

import pickle
from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import Any, Final

from cxbridge.closing import Closing
from cxbridge.errors import CxbridgeError
from cxbridge.extras import install_command
from cxbridge_explore.sweep.engine import MOST_DEATHS
from cxbridge_explore.sweep.parcel import pack
from cxbridge_explore.sweep.remote import modules, play_remotely
from cxbridge_explore.sweep.rows import CRASHED, RunRow, SweepJob

_CHUNK: Final = 32  # seeds per task
_TIMEOUT_S: Final = 30  # seconds to connect to the scheduler


class DaskEngine(Closing):
    """Plays runs on the workers of a Dask scheduler. The job contains the agent and the code of cxbridge.

    If a worker dies, Dask gives its work to another worker.

    :param address: ``HOST:PORT`` of the scheduler.
    :raises CxbridgeError: if the scheduler does not reply, or distributed is not installed.
    """

    def __init__(self, address: str) -> None:
        try:
            cloudpickle: Any = import_module("cloudpickle")  # the package has no types
            self._dask: Any = import_module("distributed")
        except ModuleNotFoundError as error:
            raise CxbridgeError(
                f"--engine dask:// needs the package '{error.name}'",
                hint=install_command("dask", "cxbridge-explore"),
            ) from None
        for module in modules():
            cloudpickle.register_pickle_by_value(module)
        try:
            self._client: Any = self._dask.Client(f"tcp://{address}", timeout=_TIMEOUT_S)
        except (OSError, ValueError) as error:
            raise CxbridgeError(
                f"no Dask scheduler answers at {address}: {error}", hint="start one: dask scheduler"
            ) from error

    def rows(self, job: SweepJob, seeds: Sequence[int]) -> Iterator[RunRow]:
        parcel = self._client.scatter(pack(job), broadcast=True)
        chunks = [list(seeds[start : start + _CHUNK]) for start in range(0, len(seeds), _CHUNK)]
        waiting = {self._submit(parcel, chunk): chunk for chunk in chunks}
        completed = self._dask.as_completed(list(waiting))
        for future in completed:
            chunk = waiting.pop(future)
            error = future.exception()
            if isinstance(error, self._dask.scheduler.KilledWorker | RuntimeError):
                answers: list[bytes] = []
                if len(chunk) == 1:
                    yield RunRow(chunk[0], CRASHED, str(error))
                    continue
            elif error is not None:
                raise CxbridgeError(f"Dask: {error}") from error
            else:
                answers = future.result()
            for answer in answers:
                row = pickle.loads(answer)  # noqa: S301 - from our code on our workers
                if isinstance(row, CxbridgeError):
                    raise row
                chunk.remove(row.seed)
                yield row
            # The first remaining seed killed the worker, so it is retried alone.
            for part in (chunk[:1], chunk[1:]):
                if part:
                    again = self._submit(parcel, part)
                    waiting[again] = part
                    completed.add(again)

    def _submit(self, parcel: Any, chunk: list[int]) -> Any:
        return self._client.submit(play_remotely, parcel, list(chunk), retries=MOST_DEATHS, pure=False)

    def close(self) -> None:
        """Disconnect from the scheduler; unfinished work is dropped."""
        self._client.close()
