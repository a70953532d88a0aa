"""`cxbridge run scenarios/test-scenario`, cold and recorded, as a whole process.

If ROS2CX_2021_DIR names a checkout, the spec test-nav2 of the thesis is measured, too. It runs with the
thesis' core and with planning.
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.harness import report

ROOT = Path(__file__).resolve().parent.parent
RUNS = 7
FAWKES_SECONDS = 10.3
"""The duration of the recorded run of the real Fawkes, in real time."""


def run_scenario_seconds(folder: Path, *, is_recorded: bool) -> float:
    """Run the scenario in a new process; return the wall time."""
    command = [sys.executable, "-m", "cxbridge", "run", "scenarios/test-scenario", "-q"]
    if is_recorded:
        command += ["--trace", str(folder / "t.mcap"), "--log", str(folder / "t.log")]
    started = time.perf_counter()
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return time.perf_counter() - started


def measure_thesis(checkout: str) -> None:
    """Run the thesis' plan of seven moves; print wall and processor time, with the planner's process."""
    command = [sys.executable, "-m", "cxbridge", "run", "--ros2cx", checkout, "--spec", "test-nav2", "-q"]
    wall_seconds, busy_seconds = [], []
    for _ in range(RUNS):
        before, started = finished_processor_seconds(), time.perf_counter()
        subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
        wall_seconds.append(time.perf_counter() - started)
        busy_seconds.append(finished_processor_seconds() - before)
    for name, seconds in (("wall", wall_seconds), ("processor", busy_seconds)):
        print(f"test-nav2: {name} time {min(seconds):.3f} to {max(seconds):.3f} s")
    report("test-nav2 of the thesis, seconds of wall time", statistics.median(wall_seconds), limit=2.0)
    report("the same, seconds of processor time", statistics.median(busy_seconds), limit=2.0)


def finished_processor_seconds() -> float:
    """Return the processor time of finished child processes."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        run_scenario_seconds(Path(folder), is_recorded=True)  # fills the caches of files and bytecode
        recorded = [run_scenario_seconds(Path(folder), is_recorded=True) for _ in range(RUNS)]
        plain = [run_scenario_seconds(Path(folder), is_recorded=False) for _ in range(RUNS)]
    recorded_s = statistics.median(recorded)
    print(f"recorded {min(recorded):.3f} to {max(recorded):.3f} s")
    print(f"not recorded {statistics.median(plain):.3f} s")
    report("seconds of wall time, cold, recorded", recorded_s, limit=1.0)
    print(f"{FAWKES_SECONDS / recorded_s:.0f} times as fast as the real Fawkes ({FAWKES_SECONDS} s)")
    if checkout := os.environ.get("ROS2CX_2021_DIR"):
        measure_thesis(checkout)
    else:
        print("ROS2CX_2021_DIR names no checkout: the executive of the thesis is not measured")


if __name__ == "__main__":
    main()
