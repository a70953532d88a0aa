"""The part of a sweep on a machine of a cluster: unpacks a parcel, and plays in child processes.

It imports nothing of ours but frames: both modules travel as text, to workers that need not have cxbridge,
only its dependencies.
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

CODE: Final = "code"
"""The folder of a parcel that has the package."""

AGENT: Final = "agent"
"""The folder of a parcel that has the files of the agent; the work folder of who plays it."""

JOB: Final = "job"
"""The file of a parcel that has the job, as :mod:`cxbridge_explore.sweep.worker` wants it."""

_LOADED: Final = pickle.dumps(None)
_CACHE: dict[tuple[str, int], subprocess.Popen[bytes]] = {}
_FOLDERS: dict[str, Path] = {}
_LOCK: Final = threading.Lock()


def play_remotely(parcel: bytes, seeds: list[int]) -> list[bytes]:
    """Play the runs of some seeds; return a pickled row for each, or the error that ended it.

    :raises RuntimeError: when the process that plays dies: the cluster tries elsewhere.
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
    """Start the child process with this thread's next call."""
    worker = _CACHE.pop((digest, threading.get_ident()), None)
    if worker is not None:
        worker.kill()
        worker.wait()


def _unpacked(parcel: bytes, digest: str) -> Path:
    """Return the folder of a parcel; removed when this process ends."""
    with _LOCK:
        folder = _FOLDERS.get(digest)
        if folder is None:
            folder = _FOLDERS[digest] = Path(tempfile.mkdtemp(prefix="cxbridge-sweep-"))
            atexit.register(shutil.rmtree, folder, ignore_errors=True)
            with zipfile.ZipFile(io.BytesIO(parcel)) as files:
                files.extractall(folder)
        return folder


def modules() -> tuple[Any, ...]:
    """Return the modules that have to travel."""
    return (frames, sys.modules[__name__])
