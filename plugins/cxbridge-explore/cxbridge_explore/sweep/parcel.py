"""Parcels: the job of a sweep with the files of its agent, for the machines of a cluster.

A parcel is a zip file with the pickled job, and the files that the options of the job name. Dask sends the
parcel to each worker. A worker unpacks the parcel once, and plays the runs in a child process like the local
engine.
"""

from __future__ import annotations

import atexit
import hashlib
import io
import pickle
import shutil
import tempfile
import threading
import zipfile
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge.run.source import source_of
from cxbridge_explore.sweep.engine import WorkerDiedError, WorkerProcess
from cxbridge_explore.sweep.rows import RunRow, SweepJob

MAX_AGENT_BYTES: Final = 64 * 1024 * 1024  # limit of the size of an agent's files before compression

# Names in a parcel: the folder with the agent's files, in which the child process runs, and the job.
_AGENT_FOLDER: Final = "agent"
_JOB_FILE: Final = "job"

_SKIPPED_NAMES: Final = frozenset({"__pycache__", ".git", ".venv", "node_modules"})
# Options whose folders are too large to pack, and must exist at the same path on each machine.
_UNPACKED_OPTIONS: Final = frozenset({"fawkes_dir", "overlays"})

# The child processes on this machine, by digest of the parcel and by thread: a process serves one thread.
_PROCESSES: dict[tuple[bytes, int], WorkerProcess] = {}


def pack_job(job: SweepJob) -> bytes:
    """Pack a job with the files of its agent into a parcel.

    :raises CxbridgeError: if the agent is too large, or a file cannot be read.
    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        packer = _Packer(archive)
        options = job.options
        if options.scenario is not None:  # may be the name of a shipped scenario, which becomes a path
            options = replace(options, scenario=source_of(options).config_file().parent)
        changes: dict[str, Any] = {}
        for field in fields(options):
            value = getattr(options, field.name)
            if field.name in _UNPACKED_OPTIONS:
                continue
            if isinstance(value, Path):
                changes[field.name] = packer.add(value)
            elif isinstance(value, tuple) and any(isinstance(item, Path) for item in value):
                changes[field.name] = tuple(packer.add(item) for item in value)
        world = None if job.world is None else packer.add(job.world)
        archive.writestr(f"{_AGENT_FOLDER}/.here", b"")  # creates the folder even if the agent has no files
        archive.writestr(
            _JOB_FILE, pickle.dumps(replace(job, options=replace(options, **changes), world=world))
        )
    return buffer.getvalue()


class _Packer:
    """Adds files and folders to a parcel, each once."""

    def __init__(self, archive: zipfile.ZipFile) -> None:
        self._archive = archive
        self._targets: dict[Path, Path] = {}
        self._byte_count = 0

    def add(self, path: Path) -> Path:
        """Add a file or a folder, and return its path in the folder of the agent."""
        source = path.resolve()
        if source not in self._targets:
            # a numbered parent, since folders in different places may have the same name
            target = self._targets[source] = Path(str(len(self._targets)), source.name)
            for file in _list_files(source):
                self._write(source, Path(_AGENT_FOLDER, target, file.relative_to(source)), file)
        return self._targets[source]

    def _write(self, source: Path, name: Path, file: Path) -> None:
        try:
            data = file.read_bytes()
        except OSError as error:
            raise CxbridgeError(f"cannot be read: {error.strerror}", file=file) from error
        self._byte_count += len(data)
        if self._byte_count > MAX_AGENT_BYTES:
            raise CxbridgeError(
                f"the agent has more than {MAX_AGENT_BYTES >> 20} MiB of files, too many for a cluster",
                file=source,
            )
        # without the time of the file, so that equal files give equal parcels, which machines unpack once
        self._archive.writestr(zipfile.ZipInfo(name.as_posix()), data, zipfile.ZIP_DEFLATED)


def _list_files(path: Path) -> Iterator[Path]:
    """Yield the files of a folder, or the file itself."""
    if path.is_file():
        yield path
    elif path.is_dir():
        for entry in sorted(path.iterdir()):
            if entry.name not in _SKIPPED_NAMES:
                yield from _list_files(entry)


def play_parcel(parcel: bytes, seeds: list[int]) -> list[RunRow]:
    """Play the runs of some seeds in a child process on this machine.

    :returns: the rows before the end of the process, at least one.
    :raises WorkerDiedError: if the process ended before the first row. The cluster then retries the task.
    :raises CxbridgeError: if the scenario is invalid.
    """
    key = hashlib.sha256(parcel).digest(), threading.get_ident()
    if key not in _PROCESSES:
        _PROCESSES[key] = _unpack_parcel(parcel)
    rows: list[RunRow] = []
    try:
        rows.extend(_PROCESSES[key].play_seeds(seeds))
    except CxbridgeError as error:
        _PROCESSES.pop(key).close()
        if not rows or not isinstance(error, WorkerDiedError):
            raise
    return rows


def _unpack_parcel(parcel: bytes) -> WorkerProcess:
    """Unpack a parcel into a folder that is removed at exit, and start the process for its job."""
    folder = Path(tempfile.mkdtemp(prefix="cxbridge-sweep-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    with zipfile.ZipFile(io.BytesIO(parcel)) as archive:
        archive.extractall(folder)
    job: SweepJob = pickle.loads((folder / _JOB_FILE).read_bytes())  # noqa: S301 - packed by the user's command
    return WorkerProcess(job, folder / _AGENT_FOLDER)
