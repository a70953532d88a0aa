"""Runs a diagnosis in a child process, with bounded time and memory: see :mod:`.sandbox_process`.

The facts may come from a stranger's recording, and even an honest condition may have more matches than
fit into memory. The process is ended when it takes too long; its result is unknown then.
"""

from __future__ import annotations

import json
import os
import pickle
import signal
import subprocess
from typing import Final

import msgspec

from cxbridge.process.python import python_command
from cxbridge_studio.explain.rules.diagnose import diagnose, undiagnosed
from cxbridge_studio.explain.rules.diagnosis import Diagnosis
from cxbridge_studio.explain.rules.snapshot import Snapshot

LIMIT_S: Final = 25.0
"""Seconds that a diagnosis may take."""

MEMORY: Final = 2 << 30
"""Bytes of address space that it may take."""


def diagnose_in_sandbox(snapshot: Snapshot, limit_s: float | None = None) -> Diagnosis:
    """Find out how the condition of the snapshot's rule stands, as :func:`.diagnose` does.

    :param limit_s: seconds of real time; :data:`LIMIT_S` for None.
    """
    limit_s = LIMIT_S if limit_s is None else limit_s
    if snapshot.too_many:
        return diagnose(snapshot)  # there is nothing to match
    process = subprocess.Popen(  # noqa: S603 - ourselves
        python_command("-m", "cxbridge_studio.explain.rules.sandbox_process", str(MEMORY)),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
        env={**os.environ, "PYTHONHASHSEED": "0"},
    )
    with process:
        try:
            answer, _ = process.communicate(pickle.dumps(snapshot), limit_s)
        except subprocess.TimeoutExpired:
            return undiagnosed(snapshot, f"its condition is not matched within {limit_s:g} s: that was ended")
        finally:
            process.kill()
    try:
        # not msgspec's own decoder: texts of files may hold bytes that are not UTF-8
        return msgspec.convert(json.loads(answer), Diagnosis)
    except ValueError:
        return undiagnosed(snapshot, f"matching its condition {_end_of(process.returncode)}")


def _end_of(status: int) -> str:
    """Return in words how a process has ended that gave no answer."""
    if status < 0:
        return f"ended CLIPS with {signal.Signals(-status).name}: it goes too deep, or takes too much memory"
    return "takes too much memory"
