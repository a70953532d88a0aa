"""scenarios/two-agents: two executives share the work by a robot memory; one of them may die."""

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
WORK = {f"{what} {room}" for what in ("sweep", "mop") for room in ROOMS}
MAX_AGE_S = 3.0
"""Longer than a living agent ever stands still on a busy machine."""

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
    """A line of what happened in the house."""

    time_us: int
    robot: str
    what: str
    work: str


def entries(world: Path) -> list[Entry]:
    """What happened, in order."""
    lines = [line.split(maxsplit=3) for line in world.read_text().splitlines()]
    return [Entry(int(time_us), robot, what, work) for time_us, robot, what, work in lines]


def paced(**seconds: float) -> str:
    """The settings of a robot whose work takes so long."""
    all_works = {"sweep": 0.4, "fill": 1.0, "mop": 1.0} | seconds
    return ", ".join(f"{work}: {taken}" for work, taken in all_works.items())


QUICK = paced(sweep=0.1, fill=0.1, mop=0.1)


def overlay(folder: Path, uri: str = "", robot1: str = paced(), robot2: str = paced()) -> tuple[Path, Path]:
    """Write the configuration of a fleet, or of a run whose house is in a file; return it and the house."""
    world, config = folder / "house.txt", folder / "fleet.yaml"
    text = FLEET.format(uri=uri, world=world, max_age=MAX_AGE_S, robot1=robot1, robot2=robot2)
    config.write_text(text if uri else text.replace("backend: mongodb", "backend: embedded"))
    return config, world


def ends(happened: list[Entry]) -> Counter[str]:
    """How often each work came to its end."""
    return Counter(entry.work for entry in happened if entry.what == "ends" and entry.work != "fill")


def check_once(happened: list[Entry], cut_off: str = "") -> None:
    """Check that each work was done once; a work that a death cut off was begun once more."""
    assert ends(happened) == Counter(WORK)
    begun = Counter(entry.work for entry in happened if entry.what == "begins" and entry.work != "fill")
    assert begun == Counter([*WORK, *([cut_off] if cut_off in WORK else [])])


# --- one process, virtual clock ---------------------------------------------------------------------------


def test_both_work_and_nothing_is_done_twice(tmp_path: Path) -> None:
    config, world = overlay(tmp_path)
    result = run_scenario(RunOptions(scenario=SCENARIO, config=config))
    assert (result.status, result.reason) == (0, "every root goal ended COMPLETED")
    happened = entries(world)
    check_once(happened)
    assert {entry.robot for entry in happened} == {"robot1", "robot2"}
    owner = ""
    for entry in happened:  # one at a time is at the tap
        if entry.work == "fill":
            assert owner == ("" if entry.what == "begins" else entry.robot)
            owner = entry.robot if entry.what == "begins" else ""
    assert list(result.agents) == ["robot1", "robot2"]
    assert all(any(goal.goal == "HOUSE" for goal in agent.goals) for agent in result.agents.values())


def test_the_run_repeats_and_its_recording_has_both_agents(tmp_path: Path) -> None:
    files = [tmp_path / f"{name}.mcap" for name in "ab"]
    for file in files:
        assert run_scenario(RunOptions(scenario=SCENARIO, trace=file, trace_level="rules")).status == 0
    events: list[list[Event]] = [list(open_run(file)) for file in files]
    assert events[0] == events[1]
    environments = {event.env for event in events[0] if isinstance(event, RuleFired | GoalTransition)}
    assert environments == {"robot1", "robot2"}
    skillers = {event.uid for event in events[0] if isinstance(event, InterfaceWrite)}
    assert {"SkillerInterface::robot1/robot1", "SkillerInterface::robot2/robot2"} <= skillers


def test_what_was_done_but_not_told_is_found_and_not_done_again(tmp_path: Path) -> None:
    """As after a death between the end of a skill and the word of it."""
    config, world = overlay(tmp_path)
    world.write_text("1 robot1 begins sweep kitchen\n2 robot1 ends sweep kitchen\n")
    assert run_scenario(RunOptions(scenario=SCENARIO, config=config)).status == 0
    happened = entries(world)
    check_once(happened)
    assert [entry.work for entry in happened if entry.what == "finds"] == ["sweep kitchen"]


def test_who_loses_his_lock_stops_and_what_he_left_is_done_later(tmp_path: Path) -> None:
    config, world = overlay(tmp_path)
    world.touch()
    options = RunOptions(scenario=SCENARIO, config=config)
    context = make_base(options)
    with Team(options, context, agent_names(context.config)) as team:
        team.start()
        team.loop.run(
            lambda: any(entry[1:] == ("robot1", "begins", "mop kitchen") for entry in entries(world))
        )
        store = robot_memory(team.agents[0]).open()
        thief = {"$set": {"locked-by": "robot9"}}  # who never gives it back, nor renews it
        assert store.update("robmem_coordination.mutex", {"_id": "resource-kitchen"}, thief) == 1
        end_us = team.clock.now_us() + 120 * MICROSECONDS
        team.loop.run(lambda: team.is_over or team.clock.now_us() > end_us)
        assert team.is_over
    happened = entries(world)
    check_once(happened, cut_off="mop kitchen")
    begun = [entry.time_us for entry in happened if entry[2:] == ("begins", "mop kitchen")]
    assert begun[1] - begun[0] >= MAX_AGE_S * MICROSECONDS


# --- two processes, a database, one of them is killed -----------------------------------------------------


def mongo_server(port: int = 0, before: MongoServer | None = None) -> MongoServer:
    """Start a server that speaks MongoDB's protocol."""
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
def test_kill_9_of_an_agent_that_holds_a_mutex(tmp_path: Path, work: str) -> None:
    with mongo_server() as server:
        # who is to be killed is so for sure before it is done with that work
        slow = paced(**{"sweep": 0.1, "fill": 0.1, work: 30.0})
        config, world = overlay(tmp_path, server.uri, slow, QUICK)
        world.touch()
        with ExitStack() as stack:
            victim = start(stack, "robot1", config)
            until(lambda: entries(world))  # before the other one has done everything
            heir = start(stack, "robot2", config)
            until(lambda: any(e.robot == "robot1" and e.work.startswith(work) for e in entries(world)))
            victim.kill()
            victim.wait(WAIT_S)
            last = [entry for entry in entries(world) if entry.robot == "robot1"][-1]
            locks = {
                lock["_id"]: lock["lock-time"].timestamp()
                for lock in server.store.find("robmem_coordination.mutex", {"locked-by": "robot1"})
            }
            assert heir.wait(WAIT_S) == 0
        happened = entries(world)
        check_once(happened, cut_off=last.work if last.what == "begins" else "")
        # who died had a room, and the tap while it filled its tank: no other agent before both had expired
        (room,) = (name.removeprefix("resource-") for name in locks if name != "tap")
        if (last.what, last.work) == ("begins", "fill"):
            assert "tap" in locks
        for name, belongs in ((f"resource-{room}", room), ("tap", "fill")):
            if name in locks:
                begun = [e for e in happened if e.robot == "robot2" and e.work.endswith(belongs)]
                after = [e.time_us / MICROSECONDS for e in begun if e.time_us > last.time_us]
                assert after
                assert min(after) >= locks[name] + MAX_AGE_S
        assert all(not lock["locked"] for lock in server.store.find("robmem_coordination.mutex"))


# --- a database that is away ------------------------------------------------------------------------------


@pytest.fixture
def fast(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fail early when a server is away."""
    pytest.importorskip("pymongo", reason="needs pymongo")
    from cxbridge_robot_memory.mongodb import store as mongo

    monkeypatch.setattr(mongo, "_SELECTION_MS", 300)
    monkeypatch.setattr(mongo, "_PAUSE_S", 0.1)


class Alone(Run):
    """One of the agents, step by step in real time."""

    def __init__(self, config: Path) -> None:
        super().__init__(RunOptions(scenario=SCENARIO, agent="robot1", config=config, clock="real"))
        self.lines: list[str] = []
        self.bus.subscribe(self._keep, LogLine)
        self.start()

    def _keep(self, event: Event) -> None:
        if isinstance(event, LogLine):
            self.lines.append(event.text)

    def until(self, done: Callable[[], bool]) -> None:
        """Loop until something is true."""
        end_s = time.monotonic() + WAIT_S
        self.loop.run(lambda: done() or time.monotonic() > end_s)
        assert done(), self.lines[-20:]

    def outcomes(self) -> dict[str, str]:
        """How the goals ended."""
        return {goal.goal: goal.outcome for goal in self.executive.goals.all_states()}


@pytest.mark.usefixtures("fast")
def test_a_database_that_goes_away_in_a_run_and_comes_back(tmp_path: Path) -> None:
    """The works of the outage are reported after it; no work that had ended is done again."""
    server = mongo_server()
    # no other agent takes the lost lock: it waits until the lock has expired
    config, world = overlay(tmp_path, server.uri, QUICK)
    with Alone(config) as robot:
        robot.until(lambda: "robot1 ends mop kitchen" in robot.lines)
        server.stop()
        robot.until(lambda: any("failed" in line for line in robot.lines))
        with mongo_server(server.port, before=server) as again:
            robot.until(lambda: robot.is_over)
            facts = {document["_id"] for document in again.store.find("syncedrobmem.worldmodel")}
            robot.finalize()
        assert robot.outcomes()["HOUSE"] == "COMPLETED"
    assert ends(entries(world)) == Counter(WORK)
    assert facts == {f"/domain/fact/{what}?room={room}" for what in ("swept", "mopped") for room in ROOMS}
