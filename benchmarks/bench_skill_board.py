"""A loop of the skill board with 1,000 running actions over 100 agents, all in this process.

Each agent has ten executors. Each of them executes an action and reports progress in every step; the protocol
passes the progress on five times a second. A figure is the time of a loop of the service (masters, executors,
Skillers of the agents), in CPU time of this process, because these machines are shared.

    python -m benchmarks skill_board      prints the medians; TOO SLOW above 33 ms, 50 ms for the begin
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
PERIOD_US = 33_333
LIMIT_MS = 33.0
BEGINS = 7
"""The number of rounds for the time of the begin."""
BEGIN_LIMIT_MS = 50.0


class Busy(SkillExecutor):
    """Executes forever, with new progress in each loop."""

    skills = ("work",)

    def execute(self, call: SkillCall) -> Steps:  # noqa: ARG002 - the interface
        done = 0.0
        while True:
            done += 1e-4
            yield Progress(done % 1.0, "at work")


def measure(loops: int = LOOPS) -> tuple[list[float], list[float]]:
    """Return the times of loops with running actions, and of loops in which the actions began, in ms."""
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

    def loop() -> float:
        clock.sleep_until(clock.now_us() + PERIOD_US)
        begin = time.process_time()
        service.loop()
        return (time.process_time() - begin) * 1e3

    starting = []
    while sum(host.state == "BUSY" for host in service.hosts) < AGENTS * EXECUTORS:
        starting.append(loop())
        assert len(starting) < LOOPS
    running = [loop() for _ in range(loops)]
    assert sum(host.state == "BUSY" for host in service.hosts) == AGENTS * EXECUTORS
    service.close()
    return running, starting


def main() -> None:
    """Measure and print."""
    running, starting = measure()
    median, slowest = statistics.median(running), max(running)
    count = AGENTS * EXECUTORS
    verdict = "ok" if median <= LIMIT_MS else "TOO SLOW"
    print(
        f"{count} actions over {AGENTS} agents, median loop: {median:.1f} ms (limit {LIMIT_MS:g}) {verdict}"
    )
    print(f"slowest loop, with a collection of Python's garbage: {slowest:.1f} ms")
    rounds = [again for _, again in (measure(0) for _ in range(BEGINS))]
    slowest_begin = statistics.median(map(max, rounds))
    verdict = "ok" if slowest_begin <= BEGIN_LIMIT_MS else "TOO SLOW"
    print(
        f"they begin in {len(starting)} loops; the slowest of these, median of {BEGINS} rounds: "
        f"{slowest_begin:.0f} ms (limit {BEGIN_LIMIT_MS:g}) {verdict}; all of them "
        f"{statistics.median(map(sum, rounds)):.0f} ms"
    )


if __name__ == "__main__":
    main()
