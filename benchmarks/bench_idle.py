"""An idle daemon with Skiller and executive: its share of a core, and its memory.

The daemon works off the test scenario first, which takes it twelve seconds. Its time on the processor is the
kernel's own account of all its threads, to the nanosecond; the main loop goes on 30 times a second.
"""

from __future__ import annotations

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


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        command = ["daemon", "test-scenario", "--endpoint", f"ipc://{folder}/bb", "--fawkes-port", "0", "-q"]
        daemon = subprocess.Popen([sys.executable, "-m", "cxbridge", *command], stderr=subprocess.DEVNULL)
        try:
            time.sleep(SETTLE_S)
            began, busy, woken = time.monotonic(), processor_seconds(daemon.pid), wakeups(daemon.pid)
            time.sleep(MEASURE_S)
            seconds = time.monotonic() - began
            share = (processor_seconds(daemon.pid) - busy) / seconds
            print(f"  {(wakeups(daemon.pid) - woken) / seconds:.0f} wake-ups a second")
            report("idle daemon, percent of a core", 100 * share, limit=1)
            report("idle daemon, MB", memory_mb(daemon.pid), limit=60)
        finally:
            daemon.terminate()
            daemon.wait()


if __name__ == "__main__":
    main()
