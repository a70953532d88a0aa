"""An idle daemon with Skiller and executive: its memory, and its share of a core against bare clipspy.

The daemon works off the test scenario first, which takes twelve seconds. The processor time is the kernel's
account of all threads of the process, to the nanosecond. The main loop runs 30 times a second. The cost of a
wake-up depends on the machine more than on the work: caches are cold after 33 ms. Therefore two rivals run in
the same minute, also 30 times a second: a process that does nothing, and a process that asserts a time fact
in bare clipspy with two rules, like :mod:`benchmarks.bench_tick`. With ROS2CX_2021_DIR the executive of
the thesis is measured too, at its own 1 Hz and at 30 Hz.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from benchmarks.harness import report

SETTLE_S = 40
"""The time in which the daemons work off their scenarios; the test scenario takes twelve seconds."""
MEASURE_S = 60
"""The time of the measurement, in which a daemon makes 1,800 loops."""

NOTHING = "a process that does nothing, 30 times a second"
CLIPS = "bare clipspy with two rules, 30 times a second"


def processor_seconds(pid: int) -> float:
    """Return the processor time of all threads of a process, in seconds."""
    files = Path(f"/proc/{pid}/task").glob("*/schedstat")
    return sum(int(file.read_text().split()[0]) for file in files) / 1e9


def count_wakeups(pid: int) -> int:
    """Return the number of voluntary context switches of a process."""
    texts = [file.read_text() for file in Path(f"/proc/{pid}/task").glob("*/status")]
    return sum(int(text.split("\nvoluntary_ctxt_switches:")[1].split("\n")[0]) for text in texts)


def memory_mb(pid: int) -> float:
    """Return the resident memory of a process, in units of 2**20 bytes."""
    return int(Path(f"/proc/{pid}/status").read_text().split("VmRSS:")[1].split()[0]) / 1024


@contextmanager
def running(command: list[str]) -> Iterator[int]:
    """Run a Python program, and yield its process id."""
    process = subprocess.Popen([sys.executable, *command], stderr=subprocess.DEVNULL)
    try:
        yield process.pid
    finally:
        process.terminate()
        process.wait()


def daemon_command(options: list[str], socket: Path) -> list[str]:
    """Return the command of a daemon, for Python, with the options that name its scenario."""
    # port 0 of the Fawkes port is any free port, so that several daemons can run
    endpoints = ["--endpoint", f"ipc://{socket}", "--fawkes-port", "0", "-q"]
    return ["-m", "cxbridge", "daemon", "start", *options, *endpoints]


def repeat(work: Callable[[], object]) -> None:
    """Repeat the work 30 times a second, until the process is ended."""
    while True:
        time.sleep(1 / 30)
        work()


RIVALS = {
    NOTHING: "from benchmarks.bench_idle import repeat; repeat(lambda: None)",
    CLIPS: "from benchmarks import bench_idle, bench_tick; bench_idle.repeat(bench_tick.make_bare_tick())",
}


def measure(scenarios: dict[str, list[str]], folder: Path) -> None:
    """Let daemons complete their scenarios, and measure all idle daemons and both rivals in the same minute.

    :param scenarios: the arguments of each daemon, by the name of its figure.
    :param folder: the folder of the daemons' sockets.
    """
    commands = {
        **{
            name: daemon_command(options, folder / f"bb{number}")
            for number, (name, options) in enumerate(scenarios.items())
        },
        **{name: ["-c", program] for name, program in RIVALS.items()},
    }
    with ExitStack() as stack:
        pids = {name: stack.enter_context(running(command)) for name, command in commands.items()}
        time.sleep(SETTLE_S)
        begin_s = time.monotonic()
        before = {name: (processor_seconds(pid), count_wakeups(pid)) for name, pid in pids.items()}
        time.sleep(MEASURE_S)
        passed_s = time.monotonic() - begin_s
        busy_seconds = {name: processor_seconds(pid) - before[name][0] for name, pid in pids.items()}
        for name in commands:
            print(f"{name}: {100 * busy_seconds[name] / passed_s:.2f} percent of a core")
        for name in scenarios:
            report(f"{name} / {CLIPS}", busy_seconds[name] / busy_seconds[CLIPS], limit=2)
            print(f"  {(count_wakeups(pids[name]) - before[name][1]) / passed_s:.0f} wake-ups a second")
            report(f"{name}, MB", memory_mb(pids[name]), limit=60)


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
