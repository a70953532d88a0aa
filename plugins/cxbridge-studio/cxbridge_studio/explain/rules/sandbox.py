"""Runs a diagnosis in a child process with limited time and memory; see :mod:`.sandbox_process`.

The facts may come from a stranger's recording, and even the condition of an honest agent may have more
matches than fit into memory. A process that exceeds its time is killed; the diagnosis then says so.
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
from cxbridge_studio.explain.rules.diagnoser import diagnose, make_unknown_diagnosis
from cxbridge_studio.explain.rules.diagnosis import Diagnosis
from cxbridge_studio.explain.rules.snapshot import Snapshot

# The limit of real time for a diagnosis; chosen freely. The child's limit of CPU time is larger, and matters
# only if this process dies.
LIMIT_S: Final = 25.0

# The limit of the child's address space; the amount is chosen freely.
MAX_MEMORY_BYTES: Final = 2 << 30


def diagnose_in_sandbox(snapshot: Snapshot) -> Diagnosis:
    """Diagnose the condition of the snapshot's rule, like :func:`.diagnose`."""
    if snapshot.uncopied_count:
        # No process is needed: the facts were not copied, so nothing can be matched.
        return diagnose(snapshot)
    process = subprocess.Popen(  # noqa: S603 - the command is a module of this package
        python_command("-m", "cxbridge_studio.explain.rules.sandbox_process", str(MAX_MEMORY_BYTES)),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # Ctrl-C reaches this process only, which kills the child
        # With one hash seed, sets have the same order in each process, so equal snapshots have equal
        # diagnoses.
        env={**os.environ, "PYTHONHASHSEED": "0"},
    )
    with process:
        try:
            output, _ = process.communicate(pickle.dumps(snapshot), LIMIT_S)
        except subprocess.TimeoutExpired:
            return make_unknown_diagnosis(
                snapshot, f"its condition could not be matched within {LIMIT_S:g} s"
            )
        finally:
            process.kill()  # without an effect on a process that has ended
    try:
        # `json` decodes, because msgspec requires UTF-8, and texts of files may contain other bytes.
        return msgspec.convert(json.loads(output), Diagnosis)
    except ValueError:
        return make_unknown_diagnosis(
            snapshot, f"matching its condition {_describe_exit(process.returncode)}"
        )


def _describe_exit(status: int) -> str:
    """Return how a process without a valid diagnosis ended, as the end of a sentence.

    :param status: as in :attr:`subprocess.Popen.returncode`, negative for a signal.
    """
    if status < 0:
        name = signal.Signals(-status).name
        return f"ended CLIPS with {name}: it is nested too deeply, or needs too much memory"
    # The process returns Python's errors as diagnoses; only CLIPS exits, if it cannot allocate memory.
    return "takes too much memory"
