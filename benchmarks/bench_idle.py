"""An idle daemon with Skiller and executive: its share of a core, and its memory.

The daemon works off the test scenario first, which takes it twelve seconds. Its time on the processor is the
kernel's own account of all its threads, to the nanosecond; the main loop goes on 30 times a second. With
ROS2CX_2021_DIR the executive of the thesis is measured likewise, at its 1 Hz and at 30 Hz.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.harness import report

SETTLE_S = 20
MEASURE_S = 60


def processor_seconds(pid: int) -> float:
    """Return how long all threads of a process were on a processor."""
    files = Path(f"/proc/{pid}/task").glob("*/schedstat")
    return sum(int(file.read_text().split()[0]) for file in files) / 1e9


def wakeups(pid: int) -> int:
    """Return how often threads of a process went to sleep."""
    texts = [file.read_text() for file in Path(f"/proc/{pid}/task").glob("*/status")]
    return sum(int(text.split("\nvoluntary_ctxt_switches:")[1].split("\n")[0]) for text in texts)


def memory_mb(pid: int) -> float:
    """Return the resident memory of a process."""
    return int(Path(f"/proc/{pid}/status").read_text().split("VmRSS:")[1].split()[0]) / 1024


def measure(name: str, scenario: list[str], settle_s: float = SETTLE_S) -> None:
    """Start a daemon, let it work its scenario off, and measure what it takes when there is nothing to do."""
    with tempfile.TemporaryDirectory() as folder:
        command = [
            "daemon",
            "start",
            *scenario,
            "--endpoint",
            f"ipc://{folder}/bb",
            "--fawkes-port",
            "0",
            "-q",
        ]
        daemon = subprocess.Popen([sys.executable, "-m", "cxbridge", *command], stderr=subprocess.DEVNULL)
        try:
            time.sleep(settle_s)
            began, busy, woken = time.monotonic(), processor_seconds(daemon.pid), wakeups(daemon.pid)
            time.sleep(MEASURE_S)
            seconds = time.monotonic() - began
            share = (processor_seconds(daemon.pid) - busy) / seconds
            print(f"  {(wakeups(daemon.pid) - woken) / seconds:.0f} wake-ups a second")
            report(f"{name}, percent of a core", 100 * share, limit=1)
            report(f"{name}, MB", memory_mb(daemon.pid), limit=60)
        finally:
            daemon.terminate()
            daemon.wait()


def thesis(checkout: str) -> None:
    """Measure the executive of the thesis after its seven moves."""
    with tempfile.TemporaryDirectory() as folder:
        for rate in (1, 30):
            file = Path(folder) / "rate.yaml"
            file.write_text(f"clips-executive: {{refresh-rate: {rate}}}\n")
            scenario = ["--ros2cx", checkout, "--spec", "test-nav2", "--config", str(file)]
            measure(f"idle daemon with the thesis' executive at {rate} Hz", scenario, 2 * SETTLE_S)


def main() -> None:
    """Measure and print."""
    measure("idle daemon", ["test-scenario"])
    if checkout := os.environ.get("ROS2CX_2021_DIR"):
        thesis(checkout)
    else:
        print("ROS2CX_2021_DIR names no checkout: the executive of the thesis is not measured")


if __name__ == "__main__":
    main()
