"""The process of one diagnosis: ``python -m cxbridge_studio.explain.rules.sandbox_process BYTES``.

A pickled :class:`Snapshot` comes on standard input, from the process that started this one; the diagnosis
goes to standard output as JSON: nothing that CLIPS does here can hand back more than texts and numbers. In
between this process can neither open a file nor start another process, and its memory and time are bounded.
"""

from __future__ import annotations

import json
import os
import pickle
import sys
from dataclasses import asdict
from typing import Final

from cxbridge_studio.explain.rules.diagnose import diagnose, undiagnosed

CPU_S: Final = 30
"""Seconds of work, in case the parent is gone and cannot end it."""


def _drop_rights(memory: int) -> None:
    """Give up rights that a diagnosis does not need. Windows has no such bounds.

    :param memory: bytes of address space that are left to it.
    """
    if sys.platform == "win32":
        return
    import resource  # noqa: PLC0415

    for limited, limit in (
        (resource.RLIMIT_AS, memory),
        (resource.RLIMIT_CPU, CPU_S),
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_FSIZE, 0),
        (resource.RLIMIT_NPROC, 0),
        (resource.RLIMIT_NOFILE, 0),
    ):
        hard = resource.getrlimit(limited)[1]
        most = limit if hard == resource.RLIM_INFINITY else min(limit, hard)
        resource.setrlimit(limited, (most, most))


def main(memory: int) -> None:
    """Diagnose one rule."""
    snapshot = pickle.loads(sys.stdin.buffer.read())  # noqa: S301  from the process that started this one
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    _drop_rights(memory)
    try:
        found = diagnose(snapshot)
    except MemoryError:
        found = undiagnosed(snapshot, "matching its condition takes too much memory")
    except Exception as error:  # noqa: BLE001  what is looked at may be anything
        found = undiagnosed(snapshot, f"its condition cannot be looked at: {type(error).__name__}: {error}")
    json.dump(asdict(found), answers)
    answers.flush()
    os._exit(0)  # what CLIPS holds goes with the process


if __name__ == "__main__":
    main(int(sys.argv[1]))
