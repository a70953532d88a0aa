"""A loop of the skill board with 1,000 running actions over 100 agents, all in this process.

Each agent has ten executors. Each of them executes an action and reports progress in every loop; the protocol
passes the progress on five times a second. A figure is the time of a loop of the service (masters, executors,
Skillers of the agents), in CPU time of this process, because other processes may use the machine as well.

    python -m benchmarks skill_board

It prints the median of the loops with running actions, which is TOO SLOW above 33 ms, and the slowest of the
loops that start all actions, which is TOO SLOW above 50 ms.
"""

from __future__ import annotations

import statistics
import time
from pathlib import Path

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.skiller.board import ExecutorContext, Progress, SkillCall, SkillExecutor, Steps
from cxbridge.skiller.board.host import ExecutorHost
from cxbridge.skiller.board.service import SkillBoardService
from cxbridge.skiller.board.settings import AgentSettings, BoardSettings

AGENTS = 100
EXECUTORS = 10
LOOPS = 150
PERIOD_US = 33_333  # of the main loop
LIMIT_MS = 33.0
"""The limit for the median loop: the period of the main loop."""
START_ROUNDS = 7
"""The number of rounds that measure the start of the actions."""
START_LIMIT_MS = 50.0  # one and a half periods of the main loop
"""The limit for the slowest loop that starts actions, the median of the rounds."""


class Busy(SkillExecutor):
    """Executes forever, with new progress in each loop."""

    skills = ("work",)

    def execute(self, call: SkillCall) -> Steps:  # noqa: ARG002 - the interface
        done = 0.0
        while True:
            done += 1e-4
            yield Progress(done % 1.0, "at work")


def measure(loops: int = LOOPS) -> tuple[list[float], list[float]]:
    """Return the times in ms of the loops with running actions, and of the loops that start the actions.

    :param loops: the number of loops with running actions; 0 to measure the start alone.
    """
    clock = VirtualClock()
    board = LocalBlackBoard(InterfaceRegistry(), clock)
    bus = EventBus(clock)
    names = [f"robot{number}" for number in range(AGENTS)]
    settings = BoardSettings(agents=tuple(AgentSettings(name, name) for name in names))
    service = SkillBoardService(board, clock, bus, settings)
    for name in names:
        for number in range(EXECUTORS):
            context = ExecutorContext(name, board, clock, bus.logger(name), {}, Path())
            service.add(ExecutorHost(Busy(context), f"{name}-{number}"))
    service.loop()
    # one skill string of ten calls for each Skiller
    readers = [board.open_for_reading("SkillerInterface", name, owner="bench") for name in names]
    for reader in readers:
        message = reader.create_message("ExecSkillMessage")
        message.set("skill_string", "; ".join(f"work{{n={number}}}" for number in range(EXECUTORS)))
        reader.msgq_enqueue(message)

    def loop_ms() -> float:
        clock.sleep_until(clock.now_us() + PERIOD_US)
        begin_s = time.process_time()
        service.loop()
        return (time.process_time() - begin_s) * 1e3

    start_loops_ms = []
    while sum(host.state == "BUSY" for host in service.hosts) < AGENTS * EXECUTORS:
        start_loops_ms.append(loop_ms())
        assert len(start_loops_ms) < LOOPS, "the actions do not start"
    running_loops_ms = [loop_ms() for _ in range(loops)]
    assert sum(host.state == "BUSY" for host in service.hosts) == AGENTS * EXECUTORS
    service.close()
    return running_loops_ms, start_loops_ms


def main() -> None:
    """Measure and print."""
    running_loops_ms, start_loops_ms = measure()
    median_ms, slowest_ms = statistics.median(running_loops_ms), max(running_loops_ms)
    count = AGENTS * EXECUTORS
    verdict = "ok" if median_ms <= LIMIT_MS else "TOO SLOW"
    print(
        f"{count} actions over {AGENTS} agents, median loop: {median_ms:.1f} ms "
        f"(limit {LIMIT_MS:g}) {verdict}"
    )
    print(f"slowest loop, with a collection of Python's garbage: {slowest_ms:.1f} ms")
    rounds_ms = [loops_ms for _, loops_ms in (measure(0) for _ in range(START_ROUNDS))]
    slowest_start_ms = statistics.median(map(max, rounds_ms))
    verdict = "ok" if slowest_start_ms <= START_LIMIT_MS else "TOO SLOW"
    print(
        f"the actions start in {len(start_loops_ms)} loops; the slowest of these loops, median of "
        f"{START_ROUNDS} rounds: {slowest_start_ms:.0f} ms (limit {START_LIMIT_MS:g}) {verdict}; "
        f"the sum of these loops: {statistics.median(map(sum, rounds_ms)):.0f} ms"
    )


if __name__ == "__main__":
    main()
