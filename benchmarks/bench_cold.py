"""`cxbridge run test-scenario --trace`, each time in a new process, against a fixed piece of work in Python.

Both are measured in turn, by the processor time of their processes, because other processes may use the
machine as well.
Python writes its bytecode into a folder of this benchmark. An installed package has bytecode; a checkout on
a machine with PYTHONDONTWRITEBYTECODE would compile more than 200 modules in each run.
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.harness import report

ROOT = Path(__file__).resolve().parent.parent
PAIRS = 9
"""The number of measurements of each command."""
WORK = "sum(i*i for i in range(3_000_000))"
"""The fixed work, chosen freely; the ratio to its time is comparable between machines."""


def processor_seconds(command: list[str], environment: dict[str, str]) -> float:
    """Run a command, and return the processor time of its processes."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, cwd=ROOT, env=environment, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        recording = str(Path(folder) / "run.mcap")
        run = [sys.executable, "-m", "cxbridge", "run", "test-scenario", "--trace", recording]
        work = [sys.executable, "-c", WORK]
        environment = {**os.environ, "PYTHONPYCACHEPREFIX": str(Path(folder) / "bytecode")}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        processor_seconds(run, environment)  # writes the bytecode
        pairs = [
            (processor_seconds(run, environment), processor_seconds(work, environment)) for _ in range(PAIRS)
        ]
    run_seconds, work_seconds = (statistics.median(seconds) for seconds in zip(*pairs, strict=True))
    print(f"  {run_seconds:.3f} s against {work_seconds:.3f} s of processor time (medians of {PAIRS})")
    report("a cold, recorded run / a fixed piece of work", run_seconds / work_seconds, limit=1.8)


if __name__ == "__main__":
    main()
