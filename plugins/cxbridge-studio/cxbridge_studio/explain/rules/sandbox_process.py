"""The process of one diagnosis: ``python -m cxbridge_studio.explain.rules.sandbox_process BYTES``.

Standard input has a pickled :class:`Snapshot` from the parent process. The diagnosis is written to standard
output as JSON, so that the parent receives only texts and numbers. Before matching, the process gives up the
rights to open files and to start processes, and limits its memory and time; on Windows, it does not.
"""

from __future__ import annotations

import json
import os
import pickle
import sys
from dataclasses import asdict
from typing import Final

from cxbridge_studio.explain.rules.diagnoser import diagnose, make_unknown_diagnosis

# The limit of CPU time, for the case that the parent dies and cannot kill the process; more than LIMIT_S of
# the parent.
MAX_CPU_S: Final = 30


def _drop_rights(max_memory_bytes: int) -> None:
    """Limit the process's resources for the rest of its life. Windows lacks these limits.

    :param max_memory_bytes: the limit of the address space.
    """
    if sys.platform == "win32":
        return
    import resource  # noqa: PLC0415 - Windows lacks the module

    # 0 files, bytes and processes: from here on, the process can only compute, and write to open pipes.
    for resource_id, limit in (
        (resource.RLIMIT_AS, max_memory_bytes),
        (resource.RLIMIT_CPU, MAX_CPU_S),
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_FSIZE, 0),
        (resource.RLIMIT_NPROC, 0),
        (resource.RLIMIT_NOFILE, 0),
    ):
        _, hard_limit = resource.getrlimit(resource_id)
        new_limit = limit if hard_limit == resource.RLIM_INFINITY else min(limit, hard_limit)
        resource.setrlimit(resource_id, (new_limit, new_limit))


def main(max_memory_bytes: int) -> None:
    """Diagnose the rule on standard input.

    :param max_memory_bytes: the limit of the address space.
    """
    snapshot = pickle.loads(sys.stdin.buffer.read())  # noqa: S301 - from the parent process
    # The output that CLIPS prints must not mix with the diagnosis.
    output = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    _drop_rights(max_memory_bytes)
    try:
        diagnosis = diagnose(snapshot)
    except MemoryError:
        diagnosis = make_unknown_diagnosis(snapshot, "matching its condition takes too much memory")
    except Exception as error:  # noqa: BLE001 - the snapshot may have any content
        diagnosis = make_unknown_diagnosis(
            snapshot, f"its condition cannot be examined: {type(error).__name__}: {error}"
        )
    json.dump(asdict(diagnosis), output)
    output.flush()
    os._exit(0)  # Skip CLIPS' cleanup: the memory is freed with the process.


if __name__ == "__main__":
    main(int(sys.argv[1]))
