"""Exploration by fork against a process for each run, by processor time, and the memory of a forked run.

Exploration visits each run, without merging equal states, so that both do the same work. The memory of a
forked run is that of its private pages that were written to; the largest of all observed runs counts.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.bench_cold import processor_seconds
from benchmarks.harness import report

ROOT = Path(__file__).resolve().parent.parent
SCENARIO = "test-scenario"
PAIRS = 5
"""The number of measurements of each way."""
COMMAND = [sys.executable, "-m", "cxbridge", "explore", SCENARIO, "--faults", "2", "--no-merge", "--json"]
FAILURES = 6
"""The number of failures of each skill: enough for 25 runs, which share the cost of the loading."""


def private_kilobytes(pid: int) -> int:
    """Return the private memory of a process that was written to, in kilobytes."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("Private_Dirty:"))


def write_world(folder: Path) -> Path:
    """Write a world in which each skill fails in several ways."""
    failures = "".join(f"    - {{error: way {number}}}\n" for number in range(FAILURES))
    file = folder / "world.yaml"
    file.write_text(f"otherwise:\n  fails:\n{failures}")
    return file


def largest_run_kilobytes(command: list[str]) -> int:
    """Return the largest private memory of the observed runs of an exploration, in kilobytes."""
    most_kilobytes = 0
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, start_new_session=True) as process:
        while process.poll() is None:
            for folder in Path("/proc").glob("[0-9]*"):
                try:
                    fields = (folder / "stat").read_bytes().rpartition(b")")[2].split()
                    # fields 3 and 1 are session and parent: a run is a copy of the process with the scenario
                    is_run = int(fields[3]) == process.pid and int(fields[1]) != process.pid
                    if is_run and int(folder.name) != process.pid:  # not the command itself
                        most_kilobytes = max(most_kilobytes, private_kilobytes(int(folder.name)))
                except (OSError, StopIteration):
                    continue  # the process has ended; a zombie has no memory
            time.sleep(0.005)  # often, because a run takes some 40 ms
    return most_kilobytes


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        measure_exploration([*COMMAND, "--world", str(write_world(Path(folder)))])


def measure_exploration(command: list[str]) -> None:
    """Print the time and the memory of a run of an exploration, compared with a run alone.

    A run alone is a process of its own, and has simulated skills, as the runs of an exploration have.
    """
    run_command = [sys.executable, "-m", "cxbridge", "run", SCENARIO, "--skiller", "simulator"]
    seconds_pairs = []
    for _ in range(PAIRS):
        process = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
        exploration = json.loads(process.stdout)
        explored_seconds = exploration["cpu_seconds"] / exploration["runs"]
        seconds_pairs.append((explored_seconds, processor_seconds(run_command, dict(os.environ))))
    explored_s, alone_s = (statistics.median(column) for column in zip(*seconds_pairs, strict=True))
    print(f"  {1000 * explored_s:.0f} ms of processor time a run, {1000 * alone_s:.0f} ms alone")
    print(f"  {1 / explored_s:.0f} runs a second a core")
    report("a run of an exploration / a run alone", explored_s / alone_s, limit=0.1)
    report("memory of a run of its own / 5 MB", largest_run_kilobytes(command) / 5000, limit=1.0)


if __name__ == "__main__":
    main()
