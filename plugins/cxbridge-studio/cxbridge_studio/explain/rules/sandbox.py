"""Runs a diagnosis in a child process with limited time and memory; see :mod:`.sandbox_process`.

The facts may come from a stranger's recording, and even an honest condition may have more matches than fit
into memory. A process that exceeds the time is killed, and the diagnosis is unknown.
"""

from __future__ import annotations

import json
import os
import pickle
import signal
import subprocess
from typing import Final

import msgspec

from cxbridge.spawning import python_command
from cxbridge_studio.explain.rules.diagnose import diagnose, undiagnosed
from cxbridge_studio.explain.rules.diagnosis import Diagnosis
from cxbridge_studio.explain.rules.snapshot import Snapshot

LIMIT_S: Final = 25.0  # the time limit of a diagnosis, in seconds

MEMORY: Final = 2 << 30  # the limit of the child's address space, in bytes


def diagnose_in_sandbox(snapshot: Snapshot, limit_s: float | None = None) -> Diagnosis:
    """Diagnose the condition of the snapshot's rule, like :func:`.diagnose`.

    :param limit_s: real time in seconds; None for :data:`LIMIT_S`.
    """
    limit_s = LIMIT_S if limit_s is None else limit_s
    if snapshot.too_many:
        return diagnose(
            snapshot
        )  # no process is needed: the facts were not copied, so nothing can be matched
    process = subprocess.Popen(  # noqa: S603 - the command is a module of this package
        python_command("-m", "cxbridge_studio.explain.rules.sandbox_process", str(MEMORY)),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
        # The same order of sets in each process makes the same diagnosis.
        env={**os.environ, "PYTHONHASHSEED": "0"},
    )
    with process:
        try:
            output, _ = process.communicate(pickle.dumps(snapshot), limit_s)
        except subprocess.TimeoutExpired:
            return undiagnosed(snapshot, f"its condition could not be matched within {limit_s:g} s")
        finally:
            process.kill()
    try:
        # msgspec's decoder requires UTF-8, and texts of files may hold other bytes.
        return msgspec.convert(json.loads(output), Diagnosis)
    except ValueError:
        return undiagnosed(snapshot, f"matching its condition {_end_of(process.returncode)}")


def _end_of(status: int) -> str:
    """Return how a process without an answer ended."""
    if status < 0:
        return f"ended CLIPS with {signal.Signals(-status).name}: it goes too deep, or takes too much memory"
    return "takes too much memory"
