"""The core's files for several robots on the robot memory: two executives with a shared store.

Each test runs with the built-in core, and with Fawkes' own files unchanged if there is a checkout.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import MICROSECONDS, Clock, RealClock, VirtualClock, split_us
from cxbridge.config import Configuration
from cxbridge.events import EventBus
from cxbridge.executive.features.blackboard import BlackBoardFeature
from cxbridge.executive.host.environment import CORE_DIR
from cxbridge.executive.host.values import Symbol, Value
from cxbridge.executive.manager import HOST_LIBRARY, EnvironmentManager
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge_robot_memory.embedded import EmbeddedStore
from cxbridge_robot_memory.feature.feature import LIBRARY, RobotMemoryFeature
from cxbridge_robot_memory.memory import RobotMemory
from cxbridge_robot_memory.store import Store
from tests.executive.conftest import Log
from tests.support import FAWKES_DIR, needs_fawkes

FILES = (
    "saliences.clp",
    "plan.clp",
    "goal.clp",
    "domain.clp",
    "worldmodel.clp",
    "cx-identity.clp",
    "coordination-mutex.clp",
    "lock-actions.clp",
    "resource-locks.clp",
    "wm-robmem-sync.clp",
    "robot-memory-sync.clp",
)
CLIPS_DIRS = {
    "builtin": (HOST_LIBRARY, CORE_DIR / "cx", LIBRARY),
    "fawkes": tuple(
        (FAWKES_DIR or Path()) / "src/plugins" / part
        for part in ("clips/clips", "clips-executive/clips", "clips-robot-memory/robot-memory.clp")
    ),
}
MUTEXES = "robmem_coordination.mutex"
SHARED_FACTS = "syncedrobmem.worldmodel"


class World:
    """The robots, their clock and their shared store."""

    def __init__(self, core: str, folder: Path, store: Store | None = None) -> None:
        self.core = core
        self.folder = folder
        self.clock: Clock = VirtualClock() if store is None else RealClock()
        self.store: Store = store or EmbeddedStore(self.clock)
        self.robots: list[Robot] = []

    def robot(self, name: str, *files: str) -> Robot:
        """Start an executive with files of the core."""
        robot = Robot(self, name, files or FILES)
        self.robots.append(robot)
        return robot

    def loops(self, count: int = 4, seconds: float = 0.04) -> None:
        """Run loops of all robots."""
        for _ in range(count):
            self.clock.sleep_until(self.clock.now_us() + round(seconds * MICROSECONDS))
            for robot in self.robots:
                robot.loop()


class Robot:
    """An executive with only a robot memory."""

    def __init__(self, world: World, name: str, files: tuple[str, ...]) -> None:
        library, cx, robmem = CLIPS_DIRS[world.core]
        self.bus = EventBus(world.clock)
        self.log = Log(self.bus)
        self.board = LocalBlackBoard(InterfaceRegistry(), world.clock, self.bus)
        config = Configuration.from_text("a: b", "test.yaml")
        self.memory = RobotMemory(
            config, world.clock, self.bus, self.board, make_embedded=lambda _settings: world.store
        )
        self.memory.open()
        features = (BlackBoardFeature(self.board), RobotMemoryFeature(self.memory, robmem))
        self.manager = EnvironmentManager(self.bus, features, library)
        self.env = self.manager.create("executive")
        for feature in ("blackboard", "robot_memory"):
            self.manager.request("executive", feature)
        for file in files:
            assert self.env.batch(cx / file), file
        self.env.call("cx-identity-set", name)
        self.env.assert_string("(executive-init)")
        self.loop()

    def close(self) -> None:
        """Close the executive, the robot memory and the blackboard."""
        self.manager.close()
        self.memory.close()
        self.board.shutdown()

    def loop(self) -> None:
        """Run a loop."""
        self.manager.before_run("executive")
        self.env.assert_ordered("time", split_us(self.env.bus.clock.now_us()))
        self.env.refresh_agenda()
        assert self.env.run(2000) < 2000

    def only_fact(self, template: str, **slots: str) -> dict[str, Value]:
        """Return the slots of the only fact with these values."""
        (found,) = self.all_facts(template, **slots)
        return found

    def all_facts(self, template: str, **slots: str) -> list[dict[str, Value]]:
        """Return the slots of all facts with these values (underscores for dashes in names)."""
        return [
            fact
            for _, _, fact in self.env.facts(template)
            if all(str(fact[name.replace("_", "-")]) == value for name, value in slots.items())
        ]

    def mutex(self, name: str = "m") -> tuple[str, str, str, str]:
        """Return request, response, state and owner of a mutex."""
        mutex = self.only_fact("mutex", name=name)
        return tuple(str(mutex[slot]) for slot in ("request", "response", "state", "locked-by"))  # type: ignore[return-value]

    def call(self, function: str, *args: str) -> None:
        """Call a function with symbols as arguments."""
        self.env.call(function, *map(Symbol, args))

    def clear_response(self, name: str = "m") -> None:
        """Reset a response, as the sender of the request must."""
        self.env.eval(
            f"(do-for-fact ((?m mutex)) (eq ?m:name {name}) (modify ?m (request NONE) (response NONE)))"
        )

    def fact(self, text: str) -> None:
        """Assert a fact."""
        assert self.env.assert_string(text) is not None


@pytest.fixture(params=["builtin", pytest.param("fawkes", marks=needs_fawkes)])
def world(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[World]:
    world = World(request.param, tmp_path)
    yield world
    for robot in world.robots:
        robot.close()


@pytest.fixture
def robots(world: World) -> tuple[Robot, Robot]:
    robots = world.robot("R1"), world.robot("R2")
    world.loops()
    return robots


# --- coordination-mutex -----------------------------------------------------------------------------------


def test_mutex_goes_to_one_robot_then_to_other_robot(world: World, robots: tuple[Robot, Robot]) -> None:
    first, second = robots
    first.call("mutex-try-lock-async", "m")
    second.call("mutex-try-lock-async", "m")
    world.loops()
    assert first.mutex() == ("LOCK", "ACQUIRED", "LOCKED", "R1")
    # ERROR if the news of the lock preceded the second robot's request
    assert second.mutex()[:2] in (("LOCK", "REJECTED"), ("LOCK", "ERROR"))
    assert [document["locked-by"] for document in world.store.find(MUTEXES)] == ["R1"]
    for robot in robots:
        robot.clear_response()
    second.call("mutex-try-lock-async", "m")
    world.loops()
    assert second.mutex()[:2] == ("LOCK", "REJECTED")
    second.clear_response()
    first.call("mutex-unlock-async", "m")
    world.loops()
    assert first.mutex()[:3] == ("UNLOCK", "UNLOCKED", "OPEN")
    first.clear_response()
    second.call("mutex-try-lock-async", "m")
    world.loops()
    assert second.mutex() == ("LOCK", "ACQUIRED", "LOCKED", "R2")
    assert first.mutex() == ("NONE", "NONE", "LOCKED", "R2")


def test_locks_are_renewed_and_expire_after_death_of_owner(world: World, robots: tuple[Robot, Robot]) -> None:
    first, second = robots
    for robot in robots:
        for name, value in (("renew-interval", 5.0), ("max-age-sec", 12.0)):
            path = f"/config/coordination/mutex/{name}"
            robot.fact(f'(wm-fact (id "{path}") (type FLOAT) (value {value}))')
    first.call("mutex-try-lock-async", "m")
    world.loops()
    first.clear_response()
    world.loops(20, 1.0)
    second.env.eval("(mutex-expire-locks-async)")
    world.loops()
    assert first.mutex() == ("NONE", "NONE", "LOCKED", "R1")
    assert str(second.only_fact("mutex-expire-task")["state"]) == "COMPLETED"
    second.env.eval("(do-for-fact ((?t mutex-expire-task)) TRUE (retract ?t))")
    world.robots.remove(first)  # the robot died
    world.loops(20, 1.0)
    second.env.eval("(mutex-expire-locks-async)")
    world.loops()
    assert second.mutex()[2:] == ("OPEN", "")
    second.call("mutex-try-lock-async", "m")
    world.loops()
    assert second.mutex() == ("LOCK", "ACQUIRED", "LOCKED", "R2")
    world.robots.append(first)


def test_trigger_ends_with_executive(world: World, robots: tuple[Robot, Robot]) -> None:
    assert robots[0].all_facts("mutex-global-data")
    robots[0].fact("(executive-finalize)")
    robots[0].loop()
    assert robots[0].all_facts("mutex-global-data") == []
    errors = [text for text in robots[0].log.texts() if "this is no" in text or "destroyed before" in text]
    assert errors == []


# --- lock-actions -----------------------------------------------------------------------------------------


def action(robot: Robot, number: int, name: str, mutex: str = "") -> None:
    names, values = ("name", mutex) if mutex else ("", "")
    robot.fact(
        f"(plan-action (id {number}) (goal-id G) (plan-id P) (action-name {name}) (state PENDING)"
        f" (executable TRUE) (param-names {names}) (param-values {values}))"
    )


def state(robot: Robot, number: int) -> str:
    return str(robot.only_fact("plan-action", id=str(number))["state"])


def test_lock_actions_follow_mutex(world: World, robots: tuple[Robot, Robot]) -> None:
    first, second = robots
    action(first, 1, "lock", "m")
    world.loops()
    assert state(first, 1) == "EXECUTION-SUCCEEDED"
    action(second, 1, "lock", "m")
    world.loops()
    assert state(second, 1) in ("EXECUTION-FAILED", "FAILED")  # the domain may have processed the failure
    action(first, 2, "unlock", "m")
    world.loops()
    assert state(first, 2) == "EXECUTION-SUCCEEDED"
    action(second, 2, "lock", "m")
    world.loops()
    assert state(second, 2) == "EXECUTION-SUCCEEDED"
    action(first, 3, "flush-locks")
    world.loops()
    assert state(first, 3) == "EXECUTION-SUCCEEDED"
    assert world.store.find(MUTEXES) == [{"_id": "m", "locked": False}]


# --- resource-locks ---------------------------------------------------------------------------------------


def goal(robot: Robot, name: str, *resources: str) -> None:
    robot.fact(
        f"(goal (id {name}) (mode COMMITTED) (committed-to P) (required-resources {' '.join(resources)}))"
    )


def test_resources_are_locked_for_one_robot(world: World, robots: tuple[Robot, Robot]) -> None:
    first, second = robots
    goal(first, "G1", "a", "b")
    world.loops(8)
    assert set(first.only_fact("goal", id="G1")["acquired-resources"]) == {"a", "b"}
    goal(second, "G2", "b", "c")
    world.loops(8)
    assert str(second.only_fact("goal", id="G2")["outcome"]) == "REJECTED"
    assert second.only_fact("goal", id="G2")["acquired-resources"] == ()
    first.env.eval("(do-for-fact ((?g goal)) TRUE (modify ?g (mode RETRACTED)))")
    world.loops(8)
    assert first.only_fact("goal", id="G1")["acquired-resources"] == ()
    goal(second, "G3", "b", "c")
    world.loops(8)
    assert set(second.only_fact("goal", id="G3")["acquired-resources"]) == {"b", "c"}


# --- wm-robmem-sync ---------------------------------------------------------------------------------------


def value(robot: Robot, name: str) -> list[str]:
    return [str(fact["value"]) for fact in robot.all_facts("wm-fact", id=name)]


def test_facts_are_shared_changed_and_removed(world: World, robots: tuple[Robot, Robot]) -> None:
    first, second = robots
    change = world.folder / "change.clp"
    change.write_text(
        "(defrule change ?c <- (change ?id ?v) ?w <- (wm-fact (id ?id))"
        " => (retract ?c) (modify ?w (value ?v)))"
    )
    for robot in robots:
        robot.env.call("wm-robmem-sync-enable", "/shared")
        assert robot.env.batch(change)
    first.fact('(wm-fact (id "/shared/x?a=1") (type INT) (value 5))')
    first.fact('(wm-fact (id "/shared/list") (type SYMBOL) (is-list TRUE) (values p q))')
    first.fact('(wm-fact (id "/mine/y") (type INT) (value 6))')
    world.loops()
    assert value(second, "/shared/x?a=1") == ["5"]
    assert second.only_fact("wm-fact", id="/shared/list")["values"] == ("p", "q")
    assert value(second, "/mine/y") == []
    world.loops(30)
    second.fact('(change "/shared/x?a=1" 7)')
    world.loops()
    assert value(first, "/shared/x?a=1") == ["7"]
    world.loops(30)
    first.env.eval('(do-for-fact ((?w wm-fact)) (eq ?w:id "/shared/x?a=1") (retract ?w))')
    world.loops()
    assert value(second, "/shared/x?a=1") == []
    assert [document["_id"] for document in world.store.find(SHARED_FACTS)] == ["/shared/list"]


def test_fact_removed_soon_after_change_is_removed_for_all_robots(tmp_path: Path) -> None:
    # Fawkes compares whole seconds and keeps the fact
    world = World("builtin", tmp_path)
    first, second = world.robot("R1"), world.robot("R2")
    world.loops()
    first.env.call("wm-robmem-sync-enable", "/shared")
    first.fact('(wm-fact (id "/shared/x") (type INT) (value 5))')
    world.loops()
    assert value(second, "/shared/x") == ["5"]
    first.env.eval('(do-for-fact ((?w wm-fact)) (eq ?w:id "/shared/x") (retract ?w))')
    world.loops()
    assert value(second, "/shared/x") == []
    for robot in world.robots:
        robot.close()


def test_later_robot_restores_shared_facts(world: World) -> None:
    first = world.robot("R1")
    first.env.call("wm-robmem-sync-enable", "/shared")
    first.fact('(wm-fact (id "/shared/x") (type SYMBOL) (value on))')
    world.loops()
    second = world.robot("R2")
    second.env.call("wm-robmem-sync-enable", "/shared")
    second.env.eval("(wm-robmem-sync-restore)")
    world.loops()
    assert value(second, "/shared/x") == ["on"]


# --- robot-memory-sync ------------------------------------------------------------------------------------


def test_domain_is_in_robot_memory(world: World) -> None:
    robot = world.robot("R1")
    robot.fact("(domain-object (name bob) (type person))")
    robot.fact("(domain-fact (name said) (param-values bob hello))")
    world.loops()

    def documents() -> list[dict[str, object]]:
        found = world.store.find("robmem.clipswm", sort={"relation": 1})
        return [{name: value for name, value in document.items() if name != "_id"} for document in found]

    fact = {"relation": "domain-fact", "name": "said", "param_values": ["bob", "hello"]}
    domain_object = {"relation": "domain-object", "name": "bob", "type": "person"}
    assert documents() == [fact, domain_object]
    robot.env.eval("(do-for-fact ((?f domain-fact)) TRUE (retract ?f))")
    world.loops()
    assert documents() == [domain_object]


# --- robmem-wait-init -------------------------------------------------------------------------------------


def test_wait_for_replica_sets_ends(world: World) -> None:
    robot = world.robot("R1", "saliences.clp", "plan.clp", "goal.clp", "worldmodel.clp", "cx-identity.clp")
    robot.env.build("(deftemplate executive-init-signal (slot id (type SYMBOL)) (slot ok (default TRUE)))")
    robot.env.call("blackboard-enable-time-read")
    assert robot.env.batch(CLIPS_DIRS[world.core][1] / "robmem-wait-init.clp")
    world.loops()
    assert len(robot.all_facts("executive-init-signal", id="robmem-initialized")) >= 1
