"""The feature `skill-board`, and plan-actions that are executed over the skill board."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import pytest

from cxbridge.errors import SkillError
from cxbridge.events import EventBus, LogLine
from cxbridge.executive.features.skill_board import SkillBoardFeature
from cxbridge.executive.host.environment import CORE_DIR
from cxbridge.executive.host.values import FALSE, TRUE, Symbol
from cxbridge.executive.manager import EnvironmentManager
from tests.executive.core.core_bench import StoppedClock


@dataclass
class FakeAction:
    """An action of a skill board."""

    number: int
    skill: str
    agent: str
    parameters: dict[str, Any]
    state: str = "ASKING"
    executor: str = ""
    progress: float = 0.0
    feedback: str = ""
    error: str = ""

    @property
    def is_over(self):
        return self.state in ("SUCCEEDED", "FAILED", "CANCELLED")


@dataclass(frozen=True)
class FakeExecutor:
    """An executor of a skill board."""

    id: str
    agent: str
    skills: tuple[str, ...]
    state: str = "IDLE"


@dataclass
class FakeSkills:
    """A skill board that the test plays."""

    actions: dict[int, FakeAction] = field(default_factory=dict)
    executors: tuple[FakeExecutor, ...] = ()
    version: int = 0
    stopped: list[int] = field(default_factory=list)
    watchers: dict[int, Any] = field(default_factory=dict)

    def request(self, skill, parameters, agent, on_change):
        if skill == "impossible":
            raise SkillError("nobody can do that")
        number = len(self.actions) + 1
        self.actions[number] = FakeAction(number, skill, agent, dict(parameters))
        self.watchers[number] = on_change
        return self.actions[number]

    def request_string(self, skill_string, agent, on_change):
        return self.request(skill_string.partition("{")[0], {"string": skill_string}, agent, on_change)

    def cancel(self, number):
        self.stopped.append(number)
        return number in self.actions

    def set_action(self, number, **changes):
        """Change an action."""
        for name, value in changes.items():
            setattr(self.actions[number], name, value)
        self.watchers[number](self.actions[number])

    def show(self, *executors):
        """Have these executors."""
        self.executors, self.version = executors, self.version + 1


class Rig:
    """An environment with the feature and files."""

    def __init__(self):
        self.clock = StoppedClock()
        bus = EventBus(self.clock)
        self.lines: list[str] = []
        bus.subscribe(self._note, LogLine)
        self.skills: FakeSkills | None = FakeSkills()
        self.manager = EnvironmentManager(bus, [SkillBoardFeature(lambda: self.skills)])
        self.env = self.manager.create("executive")
        assert self.manager.request("executive", "skill-board") == TRUE

    def _note(self, event: Any) -> None:
        self.lines.append(f"{event.level.value} {event.text}")

    def tick(self):
        self.clock.time_us += 33_333
        self.env.assert_string(f"(time {self.clock.time_us // 10**6} {self.clock.time_us % 10**6})")
        self.env.run()
        for index, _, _ in list(self.env.facts("time")):
            self.env.retract(index)

    def facts(self, template):
        return [slots for _, _, slots in self.env.facts(template)]

    def load(self, *files):
        """Execute files of the core; they must be free of mistakes."""
        for file in files:
            assert self.env.batch(CORE_DIR / "cx" / file)
        assert not self.env.loader.diagnostics


@pytest.fixture
def rig():
    made = Rig()
    yield made
    made.manager.close()
    assert made.env.faults == []


def test_fact_of_request_follows_action(rig):
    text = '(skill-board-request move (create$ to speed slow) (create$ wp1 0.5 TRUE) "r1")'
    assert rig.env.eval(text) == 1
    assert rig.skills.actions[1].parameters == {"to": "wp1", "speed": 0.5, "slow": True}
    assert rig.facts("skill-board-action") == []
    rig.tick()
    (fact,) = rig.facts("skill-board-action")
    assert (fact["id"], fact["skill"], fact["agent"], fact["state"]) == (1, "move", "r1", "ASKING")
    rig.skills.set_action(1, state="RUNNING", executor="e1", progress=0.25, feedback="to wp1")
    rig.tick()
    (fact,) = rig.facts("skill-board-action")
    assert (fact["state"], fact["executor"]) == ("RUNNING", "e1")
    assert (fact["progress"], fact["feedback"]) == (0.25, "to wp1")
    rig.skills.set_action(1, state="FAILED", error="no way")
    rig.tick()
    rig.tick()
    (fact,) = rig.facts("skill-board-action")
    assert (fact["state"], fact["error"]) == ("FAILED", "no way")


def test_invalid_request_returns_0(rig):
    assert rig.env.eval('(skill-board-request impossible (create$) (create$) "r1")') == 0
    assert rig.env.eval('(skill-board-request move (create$ a b) (create$ 1) "r1")') == 0
    rig.skills = None
    assert rig.env.eval('(skill-board-call "move{}" "r1")') == 0
    assert rig.env.eval("(skill-board-cancel 1)") == FALSE
    errors = [line for line in rig.lines if line.startswith("E")]
    assert errors == [
        "E nobody can do that",
        "E move has 2 parameter names, but 1 values",
        "E there is no skill board at present",
    ]


def test_cancel_stops_action(rig):
    rig.env.eval('(skill-board-call "move{}" "r1")')
    assert rig.env.eval("(skill-board-cancel 1)") == TRUE
    assert rig.env.eval("(skill-board-cancel 7)") == FALSE
    assert rig.skills.stopped == [1, 7]


def test_facts_of_executors_follow_registration(rig):
    one, two = FakeExecutor("e1", "r1", ("move", "grasp")), FakeExecutor("e2", "r2", ("move",))
    rig.skills.show(one, two)
    rig.tick()
    assert [fact["id"] for fact in rig.facts("skill-board-executor")] == ["e1", "e2"]
    assert rig.facts("skill-board-executor")[0]["skills"] == ("move", "grasp")
    rig.skills.show(replace(one, state="BUSY"))
    rig.tick()
    (fact,) = rig.facts("skill-board-executor")
    assert (fact["id"], fact["agent"], fact["state"]) == ("e1", "r1", "BUSY")
    rig.skills = None
    rig.tick()
    assert rig.facts("skill-board-executor") == []


def test_destroyed_environment_cancels_its_actions(rig):
    for _ in range(3):
        rig.env.eval('(skill-board-call "move{}" "r1")')
    rig.skills.set_action(2, state="SUCCEEDED")
    rig.tick()
    rig.manager.destroy("executive")
    assert rig.skills.stopped == [1, 3]


# -- skill-board-actions.clp


@pytest.fixture
def acting(rig):
    """With the rules for plan-actions, a mapping for `move`, and a plan of one action."""

    def map_action(name, _names, _values):
        return "" if name == "unmappable" else f"{name}{{}}"

    rig.env.define("map-action-skill", map_action, 3)
    rig.env.batch(CORE_DIR / "host" / "ff-config.clp")
    rig.load("saliences.clp", "plan.clp", "skill-board-actions.clp")
    for path, value in (
        ("spec", "s"),
        ("specs/s/action-mapping/move", "move{}"),
        ("specs/s/action-mapping/impossible", "impossible{}"),
        ("specs/s/action-mapping/unmappable", "x"),
    ):
        rig.env.assert_fact(
            "confval", {"path": f"/clips-executive/{path}", "type": Symbol("STRING"), "value": value}
        )
    return rig


def plan_action(rig, name="move", number=1, agent="r1", state="PENDING", executable="TRUE"):
    rig.env.assert_string(
        f"(plan-action (id {number}) (plan-id P) (goal-id G) (action-name {name}) (state {state})"
        f' (executable {executable}) (skiller "{agent}"))'
    )


def state(rig, number=1):
    (fact,) = [fact for fact in rig.facts("plan-action") if fact["id"] == number]
    return str(fact["state"]), fact["error-msg"]


def test_action_is_requested_runs_and_succeeds(acting):
    plan_action(acting)
    acting.tick()
    assert state(acting)[0] == "WAITING"
    acting.skills.set_action(1, state="CONFIRMED")
    acting.tick()
    assert state(acting)[0] == "WAITING"
    acting.skills.set_action(1, state="RUNNING", executor="e1")
    acting.tick()
    assert state(acting)[0] == "RUNNING"
    acting.skills.set_action(1, state="SUCCEEDED")
    acting.tick()
    assert state(acting)[0] == "EXECUTION-SUCCEEDED"
    assert acting.facts("skill-board-action") == acting.facts("skill-board-call") == []


@pytest.mark.parametrize(
    ("end", "error", "reason"),
    [("FAILED", "no way", "no way"), ("FAILED", "", "failed"), ("CANCELLED", "", "cancelled")],
)
def test_failure_of_skill_fails_action(acting, end, error, reason):
    plan_action(acting)
    acting.tick()
    acting.skills.set_action(1, state=end, error=error)
    acting.tick()
    assert state(acting) == ("EXECUTION-FAILED", reason)
    assert acting.facts("skill-board-action") == acting.facts("skill-board-call") == []


@pytest.mark.parametrize("name", ["impossible", "unmappable"])
def test_action_without_skill_fails(acting, name):
    plan_action(acting, name)
    acting.tick()
    assert state(acting) == ("EXECUTION-FAILED", f"'{name}' cannot be requested, see the log")


@pytest.mark.parametrize(
    "slots", [{"name": "unknown"}, {"state": "FORMULATED"}, {"executable": "FALSE"}], ids=str
)
def test_ineligible_actions_are_not_requested(acting, slots):
    plan_action(acting, **slots)
    acting.tick()
    assert acting.skills.actions == {}


def test_retracted_action_is_cancelled_and_removed(acting):
    plan_action(acting)
    acting.tick()
    acting.skills.set_action(1, state="RUNNING")
    acting.tick()
    acting.env.eval("(do-for-all-facts ((?a plan-action)) TRUE (retract ?a))")
    acting.tick()
    assert acting.skills.stopped == [1]
    acting.skills.set_action(1, state="CANCELLED")
    acting.tick()
    assert acting.facts("skill-board-action") == acting.facts("skill-board-call") == []
