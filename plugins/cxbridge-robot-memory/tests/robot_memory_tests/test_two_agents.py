"""scenarios/two-agents: two executives share the work by a robot memory, and may be killed."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest

from cxbridge.clock import MICROSECONDS
from cxbridge.events import Event, GoalTransition, InterfaceWrite, LogLine, RuleFired
from cxbridge.run import RunOptions, run_scenario
from cxbridge.run.agent import Run, make_base
from cxbridge.run.agents import agent_names
from cxbridge.run.team import Team
from cxbridge.trace.formats.registry import open_run
from cxbridge_robot_memory.component import robot_memory
from tests.forked import Forked, nursery
from tests.support import ROOT

if TYPE_CHECKING:
    from robot_memory_tests.mongo_server import MongoServer

SCENARIO = ROOT / "scenarios" / "two-agents"
ROOMS = ("kitchen", "bath", "hall", "study")
WORK = {f"{task} {room}" for task in ("sweep", "mop") for room in ROOMS}
MAX_AGE_S = 3.0
"""Longer than the longest pause of an agent on a busy machine."""

WAIT_S = 90

FLEET = """
clips-executive/specs/cleaner/parameters/coordination/mutex: {{renew-interval: 0.3, max-age-sec: {max_age}}}
cxbridge:
  robot-memory: {{backend: mongodb, uri: "{uri}"}}
  agents:
    robot1/config/skill-board/agents/robot1/executors/arm: {{world: "{world}", {robot1}}}
    robot2/config/skill-board/agents/robot2/executors/arm: {{world: "{world}", {robot2}}}
"""


class Entry(NamedTuple):
    """A line of the log of the house."""

    time_us: int
    robot: str
    event: str
    work: str


def read_entries(world: Path) -> list[Entry]:
    """Return the entries of the log in their order."""
    lines = [line.split(maxsplit=3) for line in world.read_text().splitlines()]
    return [Entry(int(time_us), robot, event, work) for time_us, robot, event, work in lines]


def work_times(**seconds: float) -> str:
    """Return the settings of a robot with these durations of its works in seconds."""
    all_works = {"sweep": 0.4, "fill": 1.0, "mop": 1.0} | seconds
    return ", ".join(f"{work}: {taken}" for work, taken in all_works.items())


QUICK = work_times(sweep=0.1, fill=0.1, mop=0.1)


def overlay(
    folder: Path, uri: str = "", robot1: str = work_times(), robot2: str = work_times()
) -> tuple[Path, Path]:
    """Write the configuration of a fleet, or of a single process; return the configuration and the log."""
    world, config = folder / "house.txt", folder / "fleet.yaml"
    text = FLEET.format(uri=uri, world=world, max_age=MAX_AGE_S, robot1=robot1, robot2=robot2)
    config.write_text(text if uri else text.replace("backend: mongodb", "backend: embedded"))
    return config, world


def count_ends(log: list[Entry]) -> Counter[str]:
    """Return the number of ends of each work."""
    return Counter(entry.work for entry in log if entry.event == "ends" and entry.work != "fill")


def check_once(log: list[Entry], cut_off: str = "") -> None:
    """Check that each work was done once; a work cut off by a kill begins twice."""
    assert count_ends(log) == Counter(WORK)
    begun = Counter(entry.work for entry in log if entry.event == "begins" and entry.work != "fill")
    assert begun == Counter([*WORK, *([cut_off] if cut_off in WORK else [])])


# --- one process, virtual clock ---------------------------------------------------------------------------


def test_agents_share_works_without_repetition(tmp_path: Path) -> None:
    config, world = overlay(tmp_path)
    result = run_scenario(RunOptions(scenario=SCENARIO, config=config))
    assert (result.status, result.reason) == (0, "every root goal ended COMPLETED")
    log = read_entries(world)
    check_once(log)
    assert {entry.robot for entry in log} == {"robot1", "robot2"}
    owner = ""
    for entry in log:  # the tap has a single user at a time
        if entry.work == "fill":
            assert owner == ("" if entry.event == "begins" else entry.robot)
            owner = entry.robot if entry.event == "begins" else ""
    assert list(result.agents) == ["robot1", "robot2"]
    assert all(any(goal.goal == "HOUSE" for goal in agent.goals) for agent in result.agents.values())


def test_run_repeats_and_recording_has_both_agents(tmp_path: Path) -> None:
    files = [tmp_path / f"{name}.mcap" for name in "ab"]
    for file in files:
        assert run_scenario(RunOptions(scenario=SCENARIO, trace=file, trace_level="rules")).status == 0
    events: list[list[Event]] = [list(open_run(file)) for file in files]
    assert events[0] == events[1]
    environments = {event.env for event in events[0] if isinstance(event, RuleFired | GoalTransition)}
    assert environments == {"robot1", "robot2"}
    skillers = {event.uid for event in events[0] if isinstance(event, InterfaceWrite)}
    assert {"SkillerInterface::robot1/robot1", "SkillerInterface::robot2/robot2"} <= skillers


def test_finished_but_unreported_work_is_not_repeated(tmp_path: Path) -> None:
    """As after a kill between the end of a skill and its report."""
    config, world = overlay(tmp_path)
    world.write_text("1 robot1 begins sweep kitchen\n2 robot1 ends sweep kitchen\n")
    assert run_scenario(RunOptions(scenario=SCENARIO, config=config)).status == 0
    log = read_entries(world)
    check_once(log)
    assert [entry.work for entry in log if entry.event == "finds"] == ["sweep kitchen"]


def test_robot_that_loses_lock_stops_and_work_is_done_later(tmp_path: Path) -> None:
    config, world = overlay(tmp_path)
    world.touch()
    options = RunOptions(scenario=SCENARIO, config=config)
    context = make_base(options)
    with Team(options, context, agent_names(context.config)) as team:
        team.start()
        team.loop.run(
            lambda: any(entry[1:] == ("robot1", "begins", "mop kitchen") for entry in read_entries(world))
        )
        store = robot_memory(team.agents[0]).open()
        thief = {"$set": {"locked-by": "robot9"}}  # robot9 neither returns nor renews the lock
        assert store.update("robmem_coordination.mutex", {"_id": "resource-kitchen"}, thief) == 1
        end_us = team.clock.now_us() + 120 * MICROSECONDS
        team.loop.run(lambda: team.is_over or team.clock.now_us() > end_us)
        assert team.is_over
    log = read_entries(world)
    check_once(log, cut_off="mop kitchen")
    begun = [entry.time_us for entry in log if entry[2:] == ("begins", "mop kitchen")]
    assert begun[1] - begun[0] >= MAX_AGE_S * MICROSECONDS


# --- two processes with a database; one process is killed -------------------------------------------------


def mongo_server(port: int = 0, before: MongoServer | None = None) -> MongoServer:
    """Start a server with MongoDB's protocol."""
    pytest.importorskip("pymongo", reason="needs pymongo")
    from robot_memory_tests.mongo_server import MongoServer

    return MongoServer(port, before)


def start(stack: ExitStack, agent: str, config: Path) -> Forked:
    """Start an agent in a separate process."""
    options = f"--agent {agent} --clock real --timeout {WAIT_S}".split()
    process, *streams = nursery().begin(["run", "-q", str(SCENARIO), "--config", str(config), *options])
    for stream in streams:
        stack.enter_context(stream)
    return stack.enter_context(process)


def until(condition: Callable[[], Any]) -> None:
    end_s = time.monotonic() + WAIT_S
    while not condition():
        assert time.monotonic() < end_s
        time.sleep(0.02)


@pytest.mark.parametrize("work", ["fill", "mop"])
def test_kill_9_of_agent_with_mutex(tmp_path: Path, work: str) -> None:
    with mongo_server() as server:
        # the victim is certainly killed before the end of its slow work
        slow = work_times(**{"sweep": 0.1, "fill": 0.1, work: 30.0})
        config, world = overlay(tmp_path, server.uri, slow, QUICK)
        world.touch()
        with ExitStack() as stack:
            victim = start(stack, "robot1", config)
            until(lambda: read_entries(world))  # before the heir has finished all works
            heir = start(stack, "robot2", config)
            until(lambda: any(e.robot == "robot1" and e.work.startswith(work) for e in read_entries(world)))
            victim.kill()
            victim.wait(WAIT_S)
            last = [entry for entry in read_entries(world) if entry.robot == "robot1"][-1]
            locks = {
                lock["_id"]: lock["lock-time"].timestamp()
                for lock in server.store.find("robmem_coordination.mutex", {"locked-by": "robot1"})
            }
            assert heir.wait(WAIT_S) == 0
        log = read_entries(world)
        check_once(log, cut_off=last.work if last.event == "begins" else "")
        # the victim's room, and the tap during its filling: the heir begins after the expiry of the locks
        (room,) = (name.removeprefix("resource-") for name in locks if name != "tap")
        if (last.event, last.work) == ("begins", "fill"):
            assert "tap" in locks
        for name, belongs in ((f"resource-{room}", room), ("tap", "fill")):
            if name in locks:
                begun = [e for e in log if e.robot == "robot2" and e.work.endswith(belongs)]
                after = [e.time_us / MICROSECONDS for e in begun if e.time_us > last.time_us]
                assert after
                assert min(after) >= locks[name] + MAX_AGE_S
        assert all(not lock["locked"] for lock in server.store.find("robmem_coordination.mutex"))


# --- an unreachable database ------------------------------------------------------------------------------


@pytest.fixture
def fast(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorten the timeouts of an absent server."""
    pytest.importorskip("pymongo", reason="needs pymongo")
    from cxbridge_robot_memory.mongodb import store as mongo

    monkeypatch.setattr(mongo, "_SELECTION_MS", 300)
    monkeypatch.setattr(mongo, "_PAUSE_S", 0.1)


class SingleAgent(Run):
    """A run of one agent, loop by loop in real time."""

    def __init__(self, config: Path) -> None:
        super().__init__(RunOptions(scenario=SCENARIO, agent="robot1", config=config, clock="real"))
        self.lines: list[str] = []
        self.bus.subscribe(self._add_line, LogLine)
        self.start()

    def _add_line(self, event: Event) -> None:
        if isinstance(event, LogLine):
            self.lines.append(event.text)

    def until(self, condition: Callable[[], bool]) -> None:
        """Loop until the condition holds."""
        end_s = time.monotonic() + WAIT_S
        self.loop.run(lambda: condition() or time.monotonic() > end_s)
        assert condition(), self.lines[-20:]

    def outcomes(self) -> dict[str, str]:
        """Return the outcomes of the goals."""
        return {goal.goal: goal.outcome for goal in self.executive.goals.all_states()}


@pytest.mark.usefixtures("fast")
def test_run_continues_after_outage_of_database(tmp_path: Path) -> None:
    """The works of the outage are reported later, and no finished work is repeated."""
    server = mongo_server()
    # no other agent takes the lost lock: the agent waits for the expiry of the lock
    config, world = overlay(tmp_path, server.uri, QUICK)
    with SingleAgent(config) as robot:
        robot.until(lambda: "robot1 ends mop kitchen" in robot.lines)
        server.stop()
        robot.until(lambda: any("failed" in line for line in robot.lines))
        with mongo_server(server.port, before=server) as restarted:
            robot.until(lambda: robot.is_over)
            facts = {document["_id"] for document in restarted.store.find("syncedrobmem.worldmodel")}
            robot.finalize()
        assert robot.outcomes()["HOUSE"] == "COMPLETED"
    assert count_ends(read_entries(world)) == Counter(WORK)
    assert facts == {
        f"/domain/fact/{predicate}?room={room}" for predicate in ("swept", "mopped") for room in ROOMS
    }
