"""The cost of recording, reading and comparing runs. Run: ``python benchmarks/bench_trace.py``."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from cxbridge.clock import VirtualClock
from cxbridge.event_kinds import RecordLevel, View
from cxbridge.events import (
    BlockWrite,
    Event,
    EventBus,
    FactChange,
    GoalTransition,
    PlanActionTransition,
    RuleFired,
)
from cxbridge.interfaces.registry import default_registry
from cxbridge.trace.compare.model import Order
from cxbridge.trace.compare.runs import compare_runs
from cxbridge.trace.formats.base import RunWriter
from cxbridge.trace.formats.fawkes_log import FawkesLogWriter
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.recorder import Recorder
from cxbridge_fawkes.bblogger.writer import BBLoggerWriter

MODES = (
    "FORMULATED",
    "SELECTED",
    "EXPANDED",
    "COMMITTED",
    "DISPATCHED",
    "FINISHED",
    "EVALUATED",
    "RETRACTED",
)
STATES = ("FORMULATED", "PENDING", "WAITING", "RUNNING", "EXECUTION-SUCCEEDED", "FINAL")
SLOTS = (
    "(type ACHIEVE) (priority 0.0) (params) (meta) (required-resources) (acquired-resources) (verbosity A)"
)


def make_events(goals: int) -> list[Event]:
    """Return the events of a run with this number of sub-goals of a goal, with firings and facts."""
    events: list[Event] = []
    for number in range(goals):
        goal, parent = f"gen{number + 2}", "RUN-gen1"
        for step, mode in enumerate(MODES):
            now = (number * len(MODES) + step) * 1000
            text = f"(goal (id {goal}) (class WORK) (parent {parent}) (mode {mode}) {SLOTS})"
            events.append(RuleFired(now, "executive", step, "goal-reasoner-step", "f-8,f-86"))
            events.append(FactChange(now, "executive", True, number, "goal", text))
            events.append(GoalTransition(now, "executive", goal, "WORK", "nil", parent, mode, "UNKNOWN", ""))
        for state in STATES:
            now = number * len(MODES) * 1000 + 4500  # while the goal is DISPATCHED
            events.append(PlanActionTransition(now, "executive", "10", goal, f"{goal}-PLAN", "say", state))
    return events


def print_rate(name: str, count: int, work: Callable[[], object]) -> None:
    """Print the events per second of ``work``."""
    start = time.perf_counter()
    work()
    seconds = time.perf_counter() - start
    print(f"{name:44s} {count / seconds:12,.0f} events/s   ({count} events, {seconds:.3f} s)")


def record_events(events: list[Event], writer: RunWriter, level: RecordLevel) -> None:
    """Emit events on a recorded bus."""
    bus = EventBus(VirtualClock())
    with Recorder(bus, [writer], level):
        for event in events:
            if bus.wants(type(event)):
                bus.emit(event)


def write_all(writer: RunWriter, events: list[BlockWrite]) -> None:
    """Write events without a bus."""
    for event in events:
        writer.write(event)


def measure_bblogger(folder: Path, count: int = 20_000) -> None:
    """Measure bblogger files of an interface of common size."""
    schema = default_registry().schema("SkillerInterface")
    block = bytes(schema.datasize)
    writes = [BlockWrite(number, "SkillerInterface::Skiller", schema.hash, block) for number in range(count)]
    with BBLoggerWriter(folder, "bench", start_us=0) as writer:
        print_rate("write bblogger", count, partial(write_all, writer, writes))
    # each entry is two events: the write, and the state of the skiller
    print_rate("read bblogger", 2 * count, lambda: sum(1 for _ in open_run(folder)))


def print_import_time() -> None:
    """Print the time of a process' first mcap writer."""
    # every run has loaded these modules before its writer
    bare = "import typer, io, cxbridge.trace.recorder, cxbridge.trace.codec"
    writer = f"from {McapWriter.__module__} import McapWriter as W; W('/dev/null')"
    extra = shortest_start_seconds(f"{bare}; {writer}") - shortest_start_seconds(bare)
    print(f"{'first mcap writer of a process':44s} {extra * 1000:12.1f} ms")


def shortest_start_seconds(code: str) -> float:
    """Return the shortest of seven times of a new process with ``code``, in seconds."""
    times = []
    for _ in range(7):
        start = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], check=True)
        times.append(time.perf_counter() - start)
    return min(times)


def main(goals: int = 1000) -> None:
    """Print the rates of operations on a run with this number of sub-goals, and on bblogger files."""
    events = make_events(goals)
    transitions = [event for event in events if type(event) in RecordLevel.TRANSITIONS.event_types]
    with tempfile.TemporaryDirectory() as folder:
        mcap, log = Path(folder) / "run.mcap", Path(folder) / "run.log"
        print_import_time()
        print_rate(
            "write mcap, transitions",
            len(transitions),
            lambda: record_events(events, McapWriter(mcap), RecordLevel.TRANSITIONS),
        )
        print_rate(
            "write mcap, facts",
            len(events),
            lambda: record_events(events, McapWriter(mcap), RecordLevel.FACTS),
        )
        print_rate(
            "write text log",
            len(events),
            lambda: record_events(events, FawkesLogWriter(log), RecordLevel.FACTS),
        )
        measure_bblogger(Path(folder) / "bblogger")
        print_rate("read mcap", len(events), lambda: sum(1 for _ in open_run(mcap)))
        print_rate(
            "read mcap, transitions alone",
            len(events),
            lambda: sum(1 for _ in open_run(mcap).select(*RecordLevel.TRANSITIONS.event_types)),
        )
        print_rate("read text log", len(events), lambda: sum(1 for _ in open_run(log)))
        for view in (View.TRANSITIONS, View.RULES, View.FACTS):
            for order in Order:
                name = f"compare two mcap, {view.value}, {order.value}"
                print_rate(
                    name,
                    2 * len(events),
                    partial(compare_runs, open_run(mcap), [open_run(mcap)], view, order),
                )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
