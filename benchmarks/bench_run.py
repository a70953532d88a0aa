"""`cxbridge run scenarios/test-scenario`, cold and recorded, as a whole process."""

from __future__ import annotations

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
"""The recorded run of the real Fawkes; it lives in real time."""


def once(folder: Path, *, record: bool) -> float:
    """Run the scenario in a process of its own; return the wall time."""
    command = [sys.executable, "-m", "cxbridge", "run", "scenarios/test-scenario", "-q"]
    if record:
        command += ["--trace", str(folder / "t.mcap"), "--log", str(folder / "t.log")]
    started = time.perf_counter()
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return time.perf_counter() - started


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        once(Path(folder), record=True)
        recorded = [once(Path(folder), record=True) for _ in range(RUNS)]
        plain = [once(Path(folder), record=False) for _ in range(RUNS)]
    seconds = statistics.median(recorded)
    print(f"recorded {min(recorded):.3f} to {max(recorded):.3f} s")
    print(f"not recorded {statistics.median(plain):.3f} s")
    report("seconds of wall time, cold, recorded", seconds, limit=1.0)
    print(f"{FAWKES_SECONDS / seconds:.0f} times as fast as the real Fawkes ({FAWKES_SECONDS} s)")


if __name__ == "__main__":
    main()
