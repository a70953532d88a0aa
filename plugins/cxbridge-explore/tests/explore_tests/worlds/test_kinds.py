"""The kinds of choices in the world of a run."""

from __future__ import annotations

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, InterfaceMessage, SkillStatus
from cxbridge.mainloop import Hook
from cxbridge.run.options import RunOptions
from cxbridge.skiller.simulation.estimators import SkillPattern
from cxbridge_explore.worldmodel.distributions import Distribution, Shape
from cxbridge_explore.worldmodel.model import (
    Absence,
    DecisionTimes,
    Kill,
    MessageLoss,
    PlannerModel,
    SensedField,
    SkillFailure,
    SkillModel,
    WorldModel,
)
from cxbridge_explore.worldmodel.reading import read_world
from cxbridge_explore.worlds.points import (
    ChoiceKind,
    ChoicePoint,
    Chooser,
    PathChooser,
    RandomChooser,
    make_path,
)
from cxbridge_explore.worlds.run import WorldResult, WorldRun
from tests.support import ROOT, needs_plugin

CALM = SkillModel(SkillPattern("*"), failures=())


def options(name: str, **more: float) -> RunOptions:
    return RunOptions(scenario=ROOT / "scenarios" / name, skiller="none", timeout=more.get("timeout", 120.0))


class TakeOption:
    """Takes the option ``name`` at the choice point with index ``number`` among those of a kind."""

    def __init__(self, kind: ChoiceKind, name: str, number: int = 0) -> None:
        self._kind, self._name, self._remaining = kind, name, number

    def choose(self, point: ChoicePoint) -> int:
        if point.kind is not self._kind:
            return 0
        self._remaining -= 1
        names = [option.name for option in point.options]
        return names.index(self._name) if self._remaining == -1 else 0


def play(name: str, chooser: Chooser, world: WorldModel) -> tuple[WorldResult, list[Event]]:
    events: list[Event] = []
    with WorldRun(options(name), chooser, world) as run:
        run.assembly.bus.subscribe(events.append, SkillStatus, InterfaceMessage)
        return run.play(), events


def skills(events: list[Event], status: str) -> list[tuple[str, str]]:
    return [(e.env, e.skill_string) for e in events if isinstance(e, SkillStatus) and e.status == status]


def check_path_repeats(name: str, result: WorldResult, world: WorldModel) -> None:
    """Check that a run with the path of a result has an equal result."""
    path = make_path(choice for choice in result.choices if choice.option_index)
    repeated, _ = play(name, PathChooser(path), world)
    assert repeated == result


def test_failure_has_error_and_time():
    failure = SkillFailure("fails(hoarse)", "hoarse", 0.1, Distribution.constant(0.5))
    world = WorldModel(default_skill=SkillModel(SkillPattern("*"), (failure,)))
    result, events = play("test-scenario", TakeOption(ChoiceKind.SKILL, "fails(hoarse)"), world)
    begun, failed = (
        next(e.time_us for e in events if isinstance(e, SkillStatus) and e.status == status)
        for status in ("S_RUNNING", "S_FAILED")
    )
    assert result.choices[0].taken_option.name == "fails(hoarse)"
    assert 500_000 <= failed - begun < 700_000


def test_hanging_skill_does_not_end():
    world = WorldModel(default_skill=SkillModel(SkillPattern("*"), (), hang_probability=0.1))
    result, _ = play("test-scenario", TakeOption(ChoiceKind.SKILL, "hangs", 3), world)
    assert not result.is_over


def test_path_repeats_drawn_durations():
    duration = Distribution(Shape.UNIFORM, (1.0, 3.0))
    world = WorldModel(default_skill=SkillModel(SkillPattern("*"), (), duration))
    result, _ = play("test-scenario-pddl", RandomChooser(3), world)
    names = {choice.taken_option.name for choice in result.choices}
    assert {choice.point.kind for choice in result.choices} == {ChoiceKind.DURATION}
    assert len(names) == len(result.choices)
    check_path_repeats("test-scenario-pddl", result, world)


def test_sensed_value_is_written_by_time_and_after_skill():
    sensed = SensedField(
        "BatteryInterface::Robot", "current", (("9", 0.9), ("3", 0.1)), times_s=(1.0,), skills=("say",)
    )
    with WorldRun(
        options("test-scenario"),
        TakeOption(ChoiceKind.SENSED, "3", 1),
        WorldModel(default_skill=CALM, sensed=(sensed,)),
    ) as run:
        board = run.assembly.agents[0].board
        values = []

        def record_value() -> None:
            with board.open_for_reading("BatteryInterface", "Robot", owner="record_value") as battery:
                battery.read()
                values.append(battery.as_dict()["current"])

        run.assembly.loop.add(Hook.POST_LOOP, record_value)
        result = run.play()
    times = [choice.point.seconds for choice in result.choices if choice.point.kind is ChoiceKind.SENSED]
    assert times[0] == pytest.approx(1.0, abs=0.04)
    assert len(times) == 1 + 4, "a choice by time, and a choice after each of four skills"
    assert list(dict.fromkeys(values)) == [0, 9, 3]


def test_lost_message_delays_skill():
    world = WorldModel(
        default_skill=CALM, message_losses=(MessageLoss("SkillerInterface::Skiller", "ExecSkill"),)
    )
    result, events = play("test-scenario-pddl", TakeOption(ChoiceKind.MESSAGE, "lost"), world)
    usual, usual_events = play("test-scenario-pddl", TakeOption(ChoiceKind.MESSAGE, "arrives"), world)
    assert usual.is_over
    assert result.is_over
    assert result.verdict.run_seconds > usual.verdict.run_seconds + 1, (
        "the agent waits for the skill, and sends the message again"
    )
    assert skills(events, "S_RUNNING") == skills(usual_events, "S_RUNNING")


def test_vanished_executor_fails_skill_and_returns():
    absence = Absence("robot1-move", return_after_s=3.0)
    world = WorldModel(default_skill=CALM, absences=(absence,))
    result, events = play("two-robots", TakeOption(ChoiceKind.SKILLER, "vanishes"), world)
    assert result.is_over
    assert len(skills(events, "S_FAILED")) == 1
    robots = {e.skiller for e in events if isinstance(e, SkillStatus) and "move" in e.skill_string}
    assert robots == {"robot1", "robot2"}


def test_skiller_vanishes_at_given_time():
    world = WorldModel(default_skill=CALM, absences=(Absence("Skiller", times=DecisionTimes(1.0, 0.5, 0.6)),))
    result, _ = play("test-scenario", TakeOption(ChoiceKind.SKILLER, "vanishes"), world)
    assert [choice.point.subject for choice in result.choices] == ["Skiller"]


KILLS = WorldModel(default_skill=CALM, kills=(Kill("robot1", times=DecisionTimes(1.0, 1.0, 5.0)),))


@needs_plugin("robot-memory")
def test_second_agent_takes_over_from_killed_agent():
    result, events = play("two-agents", TakeOption(ChoiceKind.KILL, "killed", 2), KILLS)
    assert result.is_over
    kill_s = result.choices[2].point.seconds
    first_us = events[0].time_us
    robots_after_kill = {
        e.env for e in events if isinstance(e, SkillStatus) and (e.time_us - first_us) / 1e6 > kill_s
    }
    assert robots_after_kill == {"robot2"}
    assert ("robot2", 'mop{room="kitchen"}') in skills(events, "S_FINAL")


@needs_plugin("robot-memory")
def test_killed_agent_can_restart():
    world = WorldModel(
        default_skill=CALM,
        kills=(Kill("robot1", times=DecisionTimes(0.0, 1.0, 1.0333), probability=0.5, restart_after_s=2.0),),
    )
    result, events = play("two-agents", TakeOption(ChoiceKind.KILL, "killed"), world)
    assert result.is_over
    finished = {env for env, _ in skills(events, "S_FINAL")}
    assert finished == {"robot1", "robot2"}
    check_path_repeats("two-agents", result, world)


@pytest.mark.parametrize("name", ["no plan", "fails"])
def test_planner_without_plan_is_choice(name):
    world = WorldModel(default_skill=CALM, planner=PlannerModel(0.1, 0.1, 0.1, 3.0))
    result, events = play("temporal", TakeOption(ChoiceKind.PLANNER, name), world)
    assert result.choices[0].point.kind is ChoiceKind.PLANNER
    assert skills(events, "S_RUNNING") == [] or len(result.choices) > 1


def test_late_plan_delays_run():
    world = WorldModel(default_skill=CALM, planner=PlannerModel(delay_probability=0.1, delay_s=3.0))
    usual, _ = play("temporal", TakeOption(ChoiceKind.PLANNER, "plans"), world)
    robots_after_kill, _ = play("temporal", TakeOption(ChoiceKind.PLANNER, "late"), world)
    assert robots_after_kill.verdict.run_seconds == pytest.approx(usual.verdict.run_seconds + 3.0, abs=0.1)


@pytest.mark.parametrize(
    ("name", "text", "line", "message"),
    [
        ("two-robots", "skills:\n  - name: mvoe", 2, "no skill 'mvoe'(?s:.*)did you mean move"),
        ("two-robots", "skillers:\n  - name: robot1-mov", 2, "no Skiller(?s:.*)did you mean robot1-move"),
        ("two-robots", "killed:\n  - {agent: robot1}", 2, "has one agent"),
        ("two-agents", "killed:\n  - {agent: robt1}", 2, "no agent 'robt1'(?s:.*)did you mean robot1"),
        ("test-scenario", "messages:\n  - interface: SkilerInterface::a", 2, "SkilerInterface"),
        ("test-scenario", "messages:\n  - interface: SkillerInterface", 2, "SkillerInterface"),
        (
            "test-scenario",
            "sensed:\n  - {interface: BatteryInterface::a, field: curent, values: [1, 2]}",
            2,
            "did you mean current",
        ),
        (
            "test-scenario",
            "sensed:\n  - {interface: BatteryInterface::a, field: current, values: [1, many]}",
            2,
            "many",
        ),
    ],
)
def test_unknown_name_in_world_is_error_with_line(tmp_path, name, text, line, message):
    file = tmp_path / "world.yaml"
    file.write_text(text)
    with pytest.raises(CxbridgeError, match=message) as caught:
        WorldRun(options(name), RandomChooser(1), read_world(file))
    assert (str(caught.value.file), caught.value.line) == (str(file), line)
