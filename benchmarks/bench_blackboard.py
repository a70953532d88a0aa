"""What the local blackboard costs, in times of a bare copy of the same block.

The yardstick is ``target[:] = source`` with memoryviews of the size of SkillerInterface (1216 bytes),
measured in one process, round by round in turn with each operation. Times are of the process (CPU) and
rounds are short: other work on the machine does little harm. Printed is the median of the rounds' ratios.

    python benchmarks/bench_blackboard.py [--json]     exits with 1 when a write or a read is above the limit
"""

from __future__ import annotations

import json
import statistics
import sys
import timeit
from collections.abc import Callable
from time import process_time
from typing import Any

from cxbridge.blackboard import Listener, LocalBlackBoard
from cxbridge.clock import Clock, RealClock, VirtualClock
from cxbridge.interfaces import InterfaceRegistry

LIMIT = 20.0
ROUNDS = 101
NUMBER = 500
COPIES = 10  # for each operation, so that both take about as long

Operation = Callable[[], object]


class Nothing(Listener):
    """A listener that does nothing with a change."""

    def data_changed(self, interface: Any) -> None:
        """Do nothing."""


def operations(clock: Clock) -> dict[str, Operation]:
    """Return what is measured, on a blackboard with one reader."""
    board = LocalBlackBoard(InterfaceRegistry(), clock)
    writer: Any = board.open_for_writing("SkillerInterface", "Skiller", owner="bench")
    reader: Any = board.open_for_reading("SkillerInterface", "Skiller", owner="bench")
    heard: Any = board.open_for_writing("SkillerInterface", "heard", owner="bench")
    board.register_listener(Nothing(), heard)
    numbers = iter(range(1 << 31))
    message_class = writer.MESSAGES["StopExecMessage"]

    def stamp_and_write() -> None:
        writer.mark_data_refreshed()
        writer.write()

    def set_and_write() -> None:
        writer.msgid = next(numbers)
        writer.write()

    def set_and_write_heard() -> None:
        heard.msgid = next(numbers)
        heard.write()

    def write_and_read() -> None:
        writer.msgid = next(numbers)
        writer.write()
        reader.read()

    def message() -> None:
        reader.msgq_enqueue(message_class())
        writer.msgq_pop()

    return {
        "write, nothing set": writer.write,
        "write with a new time stamp": stamp_and_write,
        "set a field, write": set_and_write,
        "set, write, one listener": set_and_write_heard,
        "set, write, read": write_and_read,
        "read, nothing new": reader.read,
        "make, send, pop a message": message,
    }


def measure(operation: Operation, source: memoryview, target: memoryview) -> tuple[float, float]:
    """Return the median ratio to a bare copy, and the median time in nanoseconds."""
    copy = timeit.Timer(
        "target[:] = source", globals={"source": source, "target": target}, timer=process_time
    )
    timer = timeit.Timer("operation()", globals={"operation": operation}, timer=process_time)
    pairs = [(timer.timeit(NUMBER), copy.timeit(NUMBER * COPIES) / COPIES) for _ in range(ROUNDS)]
    ratio = statistics.median(mine / bare for mine, bare in pairs)
    return ratio, statistics.median(mine for mine, _ in pairs) / NUMBER * 1e9


def main() -> int:
    """Measure all, print, and return the exit status."""
    size = InterfaceRegistry().get("SkillerInterface").SCHEMA.datasize
    source, target = memoryview(bytearray(size)), memoryview(bytearray(size))
    rows: dict[str, dict[str, float]] = {}
    for clock in (VirtualClock(), RealClock()):
        for name, operation in operations(clock).items():
            ratio, nanoseconds = measure(operation, source, target)
            rows[f"{name} ({clock.name} clock)"] = {"ratio": round(ratio, 2), "ns": round(nanoseconds)}
    # A read that finds something new cannot be repeated alone: what a write and a read cost above a write.
    for clock_name in ("virtual", "real"):
        both, write = (
            rows[f"{name} ({clock_name} clock)"] for name in ("set, write, read", "set a field, write")
        )
        rows[f"read of something new ({clock_name} clock)"] = {
            "ratio": round(both["ratio"] - write["ratio"], 2),
            "ns": round(both["ns"] - write["ns"]),
        }
    if "--json" in sys.argv:
        print(json.dumps(rows, indent=2))
    else:
        for name, row in rows.items():
            print(f"{name:45} {row['ratio']:6.2f} x a copy {row['ns']:8.0f} ns")
    limited = [row["ratio"] for name, row in rows.items() if name.startswith(("write", "read"))]
    return int(max(limited) > LIMIT)


if __name__ == "__main__":
    sys.exit(main())
