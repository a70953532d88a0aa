"""The robot memory in this process: upserts and trigger events a second, among some thousand documents.

The best of some rounds counts: machines are noisy.

    python -m benchmarks.bench_robot_memory    exits with 1 when a limit is not reached
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.config import Configuration
from cxbridge.events import EventBus
from cxbridge.executive.features.robot_memory import RobotMemoryFeature
from cxbridge.executive.manager import EnvironmentManager
from cxbridge.executive.robmem.embedded import EmbeddedStore
from cxbridge.executive.robmem.memory import RobotMemory
from cxbridge.interfaces.registry import InterfaceRegistry

DOCUMENTS = 4000
NUMBER = 2000
ROUNDS = 3
LIMIT = 1000.0
"""Of each, a second."""

C = "robmem.test"
UPSERTS = """
(deffunction upserts (?from ?to)
  (loop-for-count (?i ?from ?to)
    (bind ?doc (bson-create))
    (bson-append ?doc "relation" domain-fact)
    (bson-append ?doc "name" (str-cat "n" (mod ?i 50)))
    (bson-append-array ?doc "param_values" (create$ (str-cat "p" ?i) q))
    (robmem-upsert "robmem.test" ?doc ?doc)
    (bson-destroy ?doc)))
"""
TAKE = """
(defrule take
  ?event <- (robmem-trigger (name "news") (ptr ?doc))
  =>
  (bson-get ?doc "fullDocument.name")
  (bson-destroy ?doc)
  (retract ?event))
"""


def best(round_: Callable[[], int]) -> float:
    """Return the most that was done a second."""
    rates = []
    for _ in range(ROUNDS):
        begin = perf_counter()
        done = round_()
        rates.append(done / (perf_counter() - begin))
    return max(rates)


def measure(file: Path | None) -> dict[str, float]:
    """Return the rates of a store, in a file or not."""
    bus = EventBus(VirtualClock())
    board = LocalBlackBoard(InterfaceRegistry(), bus.clock, bus)
    store = EmbeddedStore(bus.clock, file)
    config = Configuration.from_text("a: b", "bench.yaml")
    memory = RobotMemory(config, bus.clock, bus, board, store=store)
    manager = EnvironmentManager(bus, [RobotMemoryFeature(memory)])
    env = manager.create("executive")
    manager.request("executive", "robot_memory")
    env.build(UPSERTS)
    env.build(TAKE)
    env.call("upserts", 1, DOCUMENTS)
    following = DOCUMENTS

    def known() -> int:
        env.call("upserts", 1, NUMBER)
        return NUMBER

    def new() -> int:
        nonlocal following
        env.call("upserts", following + 1, following + NUMBER)
        following += NUMBER
        return NUMBER

    rates = {"upserts of documents that are there": best(known), "upserts of new documents": best(new)}
    env.call("robmem-trigger-register", C, env.call("bson-create"), "news")
    manager.before_run("executive")
    env.run()
    events = []
    for _ in range(ROUNDS):
        new()
        begin = perf_counter()
        manager.before_run("executive")
        fired = env.run()
        events.append(fired / (perf_counter() - begin))
    rates["trigger events asserted and taken"] = max(events)
    manager.close()
    store.close()
    board.shutdown()
    return rates


def main() -> int:
    """Print the rates; returns 1 when one is below the limit."""
    slow = False
    with tempfile.TemporaryDirectory() as folder:
        for where, file in (("in memory", None), ("in a file", Path(folder) / "memory.db")):
            for what, rate in measure(file).items():
                print(f"{what}, {where}: {rate:,.0f}/s (at least {LIMIT:,.0f}/s)")
                slow |= rate < LIMIT
    return int(slow)


if __name__ == "__main__":
    sys.exit(main())
