"""How cost grows with the number of robots, of Skillers, of agents, and of robots over ZeroMQ.

Each point is measured in a process of its own: a run on the virtual clock (robots, Skillers, agents), or a
skill board with executors in four other processes, on the real clock (zmq). A loop is one of the main loop,
30 of which fit into a second; its time is that of the processor.

    python -m benchmarks scale                          all curves
    python -m benchmarks.bench_scale [CURVE [N...]]     one, with these N
"""

from __future__ import annotations

import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks.bench_fleet import Fleet, measure
from cxbridge.blackboard import BlackBoard, LocalBlackBoard
from cxbridge.blackboard.zmq import ZmqBlackBoard, ZmqBlackBoardServer
from cxbridge.clock import MICROSECONDS, RealClock
from cxbridge.events import EventBus
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.run.options import RunOptions
from cxbridge.run.run import make_run
from cxbridge.skiller.board import ExecutorContext, Progress, SkillCall, SkillExecutor, Steps
from cxbridge.skiller.board.host import ExecutorHost
from cxbridge.skiller.board.service import SkillBoardService
from cxbridge.skiller.board.settings import AgentSettings, BoardSettings
from cxbridge.skiller.status import Status

PERIOD_S = 1 / 30
WORK_S = 0.8
PROCESSES = 4
HOUSE = Path(__file__).parent.parent / "scenarios/two-agents"


def robots(count: int) -> list[float]:
    """Robots with an executor each, and a goal each, in one executive: its loops, in milliseconds."""
    return measure(Fleet(robots=count, executors=1, goals=count, facts=0))[1:]


def skillers(count: int) -> list[float]:
    """Lua Skillers that execute a skill each, in one executive."""
    return measure(Fleet(robots=count, goals=count, facts=0, lua=True))[1:]


def agents(count: int) -> list[float]:
    """Agents, each with an executive and a robot, that share work by one robot memory: two rooms for each."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file in (each for each in HOUSE.iterdir() if each.is_file()):
            text = file.read_text()
            if file.name == "scenario.yaml":
                text = text[: text.index("    robot1:")] + "".join(
                    f"    robot{number}: {{config: {{skill-board/agents/robot{number}/executors/arm: "
                    '{class: "cleaner.py:Cleaner", sweep: 4.0, fill: 3.0, mop: 6.0}}}\n'
                    for number in range(count)
                )
            rooms = " ".join(f"room{number}" for number in range(2 * count))
            everybody = " ".join(f"robot{number}" for number in range(count))
            text = text.replace("kitchen bath hall study", rooms).replace("bath hall kitchen study", rooms)
            (folder / file.name).write_text(text.replace("robot1 robot2", everybody))
        options = RunOptions(scenario=folder)
        with make_run(options) as run:
            run.start()
            loops: list[float] = []
            while not run.is_over and len(loops) < 20_000:
                begin, start_us = time.process_time(), run.clock.now_us()
                run.loop.run_once()
                loops.append((time.process_time() - begin) * 1e3)
                run.clock.sleep_until(start_us + run.loop.period_us)
            assert run.is_over
        return loops[10:]  # those before load the agents


class Worker(SkillExecutor):
    """Works for a while, and says how far it is."""

    skills = ("work",)

    def execute(self, call: SkillCall) -> Steps:  # noqa: ARG002
        begin_us = self.clock.now_us()
        while (passed_s := (self.clock.now_us() - begin_us) / MICROSECONDS) < WORK_S:
            yield Progress(passed_s / WORK_S, "at work")


def serve(url: str, first: int, count: int) -> None:
    """Be the process of these robots' executors, until the blackboard is gone."""
    clock = RealClock()
    bus = EventBus(clock)
    with ZmqBlackBoard(url, InterfaceRegistry(), clock=clock) as board:
        hosts = [_host(board, clock, bus, number) for number in range(first, first + count)]
        for host in hosts:
            host.meet("SkillBoard")
        while True:
            begin = time.monotonic()
            for host in hosts:
                host.loop()
            time.sleep(max(0.0, begin + PERIOD_S - time.monotonic()))


def _host(board: BlackBoard, clock: RealClock, bus: EventBus, number: int) -> ExecutorHost:
    name = f"robot{number}"
    return ExecutorHost(Worker(ExecutorContext(name, board, clock, bus.logger(name), {}, Path())), name)


def zmq(count: int) -> list[float]:
    """Robots whose executors are in other processes, over ZeroMQ: loops of the process with the board."""
    clock = RealClock()
    board = LocalBlackBoard(InterfaceRegistry(), clock)
    names = [f"robot{number}" for number in range(count)]
    settings = BoardSettings(agents=tuple(AgentSettings(name, name) for name in names), in_process=False)
    service = SkillBoardService(board, clock, EventBus(clock), settings)
    loops: list[float] = []
    with (
        tempfile.TemporaryDirectory() as folder,
        ZmqBlackBoardServer(board, [f"ipc://{folder}/board"]) as server,
    ):
        share = -(-count // PROCESSES)
        children = [
            subprocess.Popen(
                [
                    sys.executable,
                    "-m",
                    "benchmarks.bench_scale",
                    "serve",
                    server.endpoints[0],
                    *map(str, (first, min(share, count - first))),
                ]
            )
            for first in range(0, count, share)
        ]
        try:
            _await(lambda: len(board.list("SkillExecutorInterface")) == count, service)
            readers = [board.open_for_reading("SkillerInterface", name, owner="bench") for name in names]
            for reader in readers:
                message = reader.create_message("ExecSkillMessage")
                message.set("skill_string", "work{}")
                reader.msgq_enqueue(message)
            done, limit = 0, time.monotonic() + 60
            while done < count:
                if time.monotonic() > limit:
                    raise TimeoutError({f"{each.get('status')} {each.get('error')}" for each in readers})
                begin, cpu = time.monotonic(), time.process_time()
                service.loop()
                loops.append((time.process_time() - cpu) * 1e3)
                time.sleep(max(0.0, begin + PERIOD_S - time.monotonic()))
                done = 0
                for reader in readers:
                    reader.read()
                    done += reader.get("status") == Status.S_FINAL
        finally:
            for child in children:
                child.kill()
                child.wait()
            service.close()
    return loops


def _await(condition: Callable[[], bool], service: SkillBoardService) -> None:
    limit = time.monotonic() + 60
    while not condition():
        if time.monotonic() > limit:
            raise TimeoutError
        service.loop()
        time.sleep(PERIOD_S)


CURVES: dict[str, tuple[Callable[[int], list[float]], tuple[int, ...]]] = {
    "robots": (robots, (10, 100, 300, 1000)),
    "skillers": (skillers, (1, 10, 30, 100)),
    "agents": (agents, (2, 5, 10, 20)),
    "zmq": (zmq, (10, 100, 300, 1000)),
}


def point(curve: str, count: int) -> dict[str, float]:
    """Measure one point of a curve, in this process."""
    loops = CURVES[curve][0](count)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {
        "loops": len(loops),
        "mean": statistics.mean(loops),
        "slowest": max(loops),
        "megabytes": memory,
    }


def main() -> None:
    """Measure and print."""
    arguments = sys.argv[1:] if __name__ == "__main__" else []
    match arguments:
        case ["serve", url, first, count]:
            serve(url, int(first), int(count))
            return
        case ["point", curve, count]:
            print(json.dumps(point(curve, int(count))))
            return
    for curve, (_, counts) in CURVES.items():
        if arguments and curve != arguments[0]:
            continue
        for number in map(int, arguments[1:]) if arguments[1:] else counts:
            command = [sys.executable, "-m", "benchmarks.bench_scale", "point", curve, str(number)]
            found = json.loads(subprocess.run(command, capture_output=True, check=True, text=True).stdout)
            print(
                f"{number:5d} {curve}: {found['loops']} loops, mean {found['mean']:.2f} ms, slowest "
                f"{found['slowest']:.1f} ms, {found['megabytes']:.0f} MB"
            )


if __name__ == "__main__":
    main()
