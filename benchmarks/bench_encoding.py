"""What a write of MotorInterface costs to encode and to record, beside msgspec alone on the same values."""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import msgspec

from benchmarks.harness import ROUNDS, report
from cxbridge.blackboard.local import LocalBlackBoard
from cxbridge.clock import RealClock
from cxbridge.events import EventBus, InterfaceWrite
from cxbridge.interfaces.registry import default_registry
from cxbridge.trace.codec import encode
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge.trace.recorder import Recorder

BATCH = 5_000
LIMIT = 2.0


def cpu_us(work: Callable[[], object]) -> float:
    """Return the time of the processor that a call takes, in microseconds."""
    started = time.process_time()
    for _ in range(BATCH):
        work()
    return (time.process_time() - started) / BATCH * 1e6


def compare(what: str, work: Callable[[], object], rival: Callable[[], object], limit: float) -> None:
    """Print the median of the ratios of ``work`` to ``rival``, each pair timed one after the other."""
    cpu_us(work), cpu_us(rival)
    pairs = [(cpu_us(work), cpu_us(rival)) for _ in range(ROUNDS)]
    ours, theirs = (statistics.median(times) for times in zip(*pairs, strict=True))
    print(f"  {ours:.2f} us against {theirs:.2f} us a call (medians of {ROUNDS}, CPU time)")
    report(what, statistics.median(first / second for first, second in pairs), limit)


def main() -> None:
    """Write a drive's interface with ten numbers that have as many digits as a robot's have."""
    bus = EventBus(RealClock())
    board = LocalBlackBoard(default_registry(), RealClock(), bus)
    motor = board.open_for_writing("MotorInterface", "Robot", owner="benchmark")
    for number, field in enumerate(field for field in motor.fields() if field.type == "float"):
        setattr(motor, field.name, 0.017 + number / 10)
    motor.set("controller_thread_name", "navigator")
    values = motor.as_dict()
    event = InterfaceWrite(RealClock().now_us(), motor.uid, values)
    plain = {"time_us": event.time_us, "uid": event.uid, "values": values}
    bare = msgspec.json.Encoder().encode
    compare("encoding to msgspec alone", lambda: encode(event), lambda: bare(plain), LIMIT)

    def take_and_encode() -> None:
        bare({"time_us": event.time_us, "uid": motor.uid, "values": motor.as_dict()})

    with (
        tempfile.TemporaryDirectory() as folder,
        Recorder(bus, [McapWriter(Path(folder) / "run.mcap")]),
    ):
        compare("a recorded write to its values and msgspec", motor.write, take_and_encode, LIMIT)
        compare("a recorded write to msgspec alone", motor.write, lambda: bare(plain), LIMIT)


if __name__ == "__main__":
    main()
