"""An idle daemon with Skiller and executive: its share of a core, and its memory.

The daemon works off the test scenario first, which takes it twelve seconds. Its time on the processor is the
kernel's own account of all its threads, to the nanosecond; the main loop goes on 30 times a second. With
ROS2CX_2021_DIR the executive of the thesis is measured beside it, at its 1 Hz and at 30 Hz.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from benchmarks.harness import report

SETTLE_S = 40
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


@contextmanager
def daemon(scenario: list[str], socket: Path) -> Iterator[int]:
    """Run a daemon; its process id."""
    where = ["--endpoint", f"ipc://{socket}", "--fawkes-port", "0", "-q"]
    command = [sys.executable, "-m", "cxbridge", "daemon", "start", *scenario, *where]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    try:
        yield process.pid
    finally:
        process.terminate()
        process.wait()


def measure(scenarios: dict[str, list[str]], folder: Path) -> None:
    """Let daemons work their scenarios off, and measure all in the same minute, with nothing to do."""
    with ExitStack() as stack:
        pids = {}
        for number, (name, scenario) in enumerate(scenarios.items()):
            pids[name] = stack.enter_context(daemon(scenario, folder / f"bb{number}"))
        time.sleep(SETTLE_S)
        began = time.monotonic()
        before = {pid: (processor_seconds(pid), wakeups(pid)) for pid in pids.values()}
        time.sleep(MEASURE_S)
        seconds = time.monotonic() - began
        for name, pid in pids.items():
            busy, woken = before[pid]
            share = (processor_seconds(pid) - busy) / seconds
            report(f"{name}, percent of a core", 100 * share, limit=0.5)
            print(f"  {(wakeups(pid) - woken) / seconds:.0f} wake-ups a second")
            report(f"{name}, MB", memory_mb(pid), limit=60)


def main() -> None:
    """Measure and print."""
    scenarios = {"idle daemon": ["test-scenario"]}
    checkout = os.environ.get("ROS2CX_2021_DIR")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for rate in (1, 30) if checkout else ():
            file = folder / f"rate{rate}.yaml"
            file.write_text(f"clips-executive: {{refresh-rate: {rate}}}\n")
            scenarios[f"idle daemon with the thesis' executive at {rate} Hz"] = [
                "--ros2cx",
                str(checkout),
                "--spec",
                "test-nav2",
                "--config",
                str(file),
            ]
        measure(scenarios, folder)
    if not checkout:
        print("ROS2CX_2021_DIR names no checkout: the executive of the thesis is not measured")


if __name__ == "__main__":
    main()
