"""The part of a sweep on a cluster machine: unpacks a parcel and plays its runs in child processes.

This module imports only frames of cxbridge. Both are sent as text to workers, which need the dependencies of
cxbridge but not cxbridge itself.
"""

from __future__ import annotations

import atexit
import hashlib
import io
import os
import pickle
import shutil
import subprocess
import sys
import tempfile
import threading
import zipfile
from pathlib import Path
from typing import Any, Final

from cxbridge_explore.sweep import frames

CODE: Final = "code"  # folder of the package in a parcel

# The folder of the agent's files in a parcel; the working directory of the runs.
AGENT: Final = "agent"

JOB: Final = "job"  # job in a parcel, as `cxbridge_explore.sweep.worker` reads it

_LOADED: Final = pickle.dumps(None)
_CACHE: dict[tuple[str, int], subprocess.Popen[bytes]] = {}
_FOLDERS: dict[str, Path] = {}
_LOCK: Final = threading.Lock()


def play_remotely(parcel: bytes, seeds: list[int]) -> list[bytes]:
    """Play the runs of some seeds and return a pickled row for each, or the error that ended the job.

    :raises RuntimeError: if the process dies; the cluster retries elsewhere.
    """
    digest = hashlib.sha256(parcel).hexdigest()
    worker = _worker(parcel, digest)
    assert worker.stdin is not None
    assert worker.stdout is not None
    try:
        frames.write_frame(worker.stdin, pickle.dumps(seeds))
        answers: list[bytes] = []
        while len(answers) < len(seeds):
            answer = frames.read_frame(worker.stdout)
            if answer is None:
                break
            if answer != _LOADED:
                answers.append(answer)
    except OSError:
        answers = []
    if len(answers) < len(seeds) and not (answers and worker.poll() == 0):
        _forget(digest)
        if not answers:
            raise RuntimeError("the process that plays the runs has died")
    return answers


def _worker(parcel: bytes, digest: str) -> subprocess.Popen[bytes]:
    """Return this thread's process for a job."""
    key = digest, threading.get_ident()
    worker = _CACHE.get(key)
    if worker is None or worker.poll() is not None:
        folder = _unpacked(parcel, digest)
        environment = {**os.environ, "PYTHONPATH": str(folder / CODE)}
        worker = _CACHE[key] = subprocess.Popen(
            [sys.executable, "-P", "-m", "cxbridge_explore.sweep.worker"],
            cwd=folder / AGENT,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        assert worker.stdin is not None
        frames.write_frame(worker.stdin, (folder / JOB).read_bytes())
    return worker


def _forget(digest: str) -> None:
    """Kill this thread's process; the next call starts another."""
    worker = _CACHE.pop((digest, threading.get_ident()), None)
    if worker is not None:
        worker.kill()
        worker.wait()


def _unpacked(parcel: bytes, digest: str) -> Path:
    """Return the folder of a parcel. It is removed at exit."""
    with _LOCK:
        folder = _FOLDERS.get(digest)
        if folder is None:
            folder = _FOLDERS[digest] = Path(tempfile.mkdtemp(prefix="cxbridge-sweep-"))
            atexit.register(shutil.rmtree, folder, ignore_errors=True)
            with zipfile.ZipFile(io.BytesIO(parcel)) as files:
                files.extractall(folder)
        return folder


def modules() -> tuple[Any, ...]:
    return (frames, sys.modules[__name__])
