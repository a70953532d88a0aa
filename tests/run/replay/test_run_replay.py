"""``run --replay``: the agent repeats its decisions in the recorded environment, or differences are shown."""

from __future__ import annotations

import json
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from cxbridge.cli.main import invoke
from cxbridge.errors import CxbridgeError, TraceError
from cxbridge.event_kinds import View
from cxbridge.events import (
    Event,
    GoalTransition,
    InterfaceWrite,
    PlanActionTransition,
    SkillStatus,
)
from cxbridge.resources import shipped_dir
from cxbridge.run import RunOptions, run_scenario
from cxbridge.trace.compare.model import Order
from cxbridge.trace.compare.runs import compare_runs
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge.trace.formats.registry import open_run
from tests.run.mini import AGENT, write_scenario
from tests.support import FAWKES_DIR, ROOT, SHARED, needs_fawkes, needs_shared, share

SCENARIOS = ROOT / "scenarios"
TRACES = SHARED / "traces" / "test-scenario"
RUNS = ("skiller-1", "skiller-2", "simulator-1")
FILES = (("bblogger", "fawkes.log"), ("fawkes.log",), ("bblogger-repaired", "trace.txt"))
"""The files of a recording of Fawkes."""


def replay(*runs: Path, order: str = "total", **options: Any) -> Any:
    """Replay recordings of a run, with the scenario that they were recorded of; return the result."""
    if "scenario" not in options and "fawkes_dir" not in options:
        known = (open_run(run).metadata().get("scenario") for run in runs)
        options["scenario"] = next((Path(name) for name in known if name), None)
    return run_scenario(RunOptions(replay=runs, replay_order=order, **options))


def rewrite(path: Path, change: Callable[[Event], Event | None], name: str = "changed.mcap") -> Path:
    """Copy a recording with changed events, or without some events."""
    run = open_run(path)
    with McapWriter(path.with_name(name)) as writer:
        writer.describe(run.metadata())
        for event in run:
            changed = change(event)
            if changed is not None:
                writer.write(changed)
    return path.with_name(name)


def skill_of(event: Event) -> str:
    """The skill string that a write of a Skiller shows; empty for everything else."""
    if isinstance(event, InterfaceWrite) and event.uid.startswith("SkillerInterface::"):
        return str(event.values["skill_string"])
    return ""


@pytest.fixture(scope="module")
def mini(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The recording of a small run with one skill."""
    folder = tmp_path_factory.mktemp("mini")
    write_scenario(folder)
    run_scenario(RunOptions(scenario=folder, trace=folder / "run.mcap"))
    return folder / "run.mcap"


# -- recordings of the real Fawkes


@needs_shared
@pytest.mark.parametrize("name", RUNS)
def test_our_scenario_decides_as_fawkes(name: str) -> None:
    folder = TRACES / name
    result = replay(
        folder / "bblogger",
        folder / "fawkes.log",
        scenario=SCENARIOS / "test-scenario",
        order="partial",
    )
    assert (result.status, result.reason.split(",")[0]) == (
        0,
        f"it decided the same as {folder / 'fawkes.log'}",
    )
    assert (result.replay.same, result.replay.is_complete) == (True, True)
    assert result.replay.report["a"]["events"] == 293


@needs_shared
@needs_fawkes
@pytest.mark.parametrize(("name", "files"), share(product(RUNS, FILES), 4, row=lambda case: case[1]))
def test_original_files_decide_line_by_line_as_fawkes(name: str, files: tuple[str, ...]) -> None:
    result = replay(*(TRACES / name / file for file in files), fawkes_dir=FAWKES_DIR, spec="test")
    assert result.status == 0, result.summary()
    assert result.replay.report["a"]["events"] == 293


@needs_shared
@pytest.mark.parametrize("hours", [-9.5, 1, 5.75])
def test_time_zone_of_log_is_irrelevant(hours: float, tmp_path: Path) -> None:
    from cxbridge.run.replay.recordings import Recordings

    folder = TRACES / "skiller-1"
    moved = tmp_path / "moved.log"
    lines = []
    for line in (folder / "fawkes.log").read_text().splitlines():
        if line[1:2] == " " and line[4:5] == ":":
            seconds = (int(line[2:4]) * 60 + int(line[5:7]) + round(hours * 60)) % 1440
            line = f"{line[:2]}{seconds // 60:02d}:{seconds % 60:02d}{line[7:]}"  # noqa: PLW2901
        lines.append(line)
    moved.write_text("\n".join(lines) + "\n")
    wanted = Recordings.read([folder / "bblogger", folder / "fawkes.log"]).start_us
    assert Recordings.read([folder / "bblogger", moved]).start_us == wanted


@needs_shared
@pytest.mark.parametrize(
    ("order", "part"),
    share(product(["total", "partial"], [0.3, 0.5, 0.65, 0.9]), 4, row=lambda case: case[0]),
)
def test_truncated_log_is_compared_up_to_its_end(order: str, part: float, tmp_path: Path) -> None:
    if order == "total" and FAWKES_DIR is None:
        pytest.skip("FAWKES_DIR names no Fawkes checkout")
    data = (TRACES / "skiller-1" / "fawkes.log").read_bytes()
    end = data.rindex(b"Cleaning up", 0, data.rindex(b"S_FINAL"))
    log = tmp_path / "cut.log"
    log.write_bytes(data[: int(end * part)])
    more: dict[str, Any] = (
        {"fawkes_dir": FAWKES_DIR, "spec": "test"}
        if order == "total"
        else {"scenario": SCENARIOS / "test-scenario"}
    )
    result = replay(log, order=order, **more)
    assert result.status == 0, result.summary()
    assert not result.replay.is_complete


# -- our own


def repeat(name: str, tmp_path: Path) -> None:
    """Record a run of a scenario, replay it, and compare both."""
    trace, again = tmp_path / "run.mcap", tmp_path / "again.mcap"
    recorded = run_scenario(RunOptions(scenario=SCENARIOS / name, trace=trace, trace_level="facts"))
    result = replay(trace, trace=again, trace_level="facts")
    assert result.status == 0, result.summary()
    assert (result.spec, result.loops) == (recorded.spec, recorded.loops)
    assert compare_runs(open_run(again), [open_run(trace)], View.TRANSITIONS, Order.TOTAL).same
    times = [
        [event.time_us for event in open_run(path) if isinstance(event, GoalTransition)]
        for path in (again, trace)
    ]
    assert times[0] == times[1]
    if name == "test-scenario":
        assert compare_runs(open_run(again), [open_run(trace)], View.FACTS, Order.TOTAL).same


@pytest.mark.parametrize("name", ["test-scenario", "two-robots"])
def test_replay_repeats_run_loop_by_loop(name: str, tmp_path: Path) -> None:
    repeat(name, tmp_path)


def test_replay_of_failed_run_has_status_0(tmp_path: Path) -> None:
    write_scenario(tmp_path, mapping="act: nosuchskill{}")
    recorded = run_scenario(RunOptions(scenario=tmp_path, trace=tmp_path / "run.mcap", strict=False))
    assert recorded.status == 1
    result = replay(tmp_path / "run.mcap")
    assert result.status == 0
    assert result.goals == recorded.goals


# -- differences


def test_different_skill_string_is_reported_with_expected_string(mini: Path) -> None:
    def change(event: Event) -> Event:
        if skill_of(event):
            assert isinstance(event, InterfaceWrite)
            return replace(event, values=dict(event.values) | {"skill_string": 'say{text="bye", wait=true}'})
        return event

    result = replay(rewrite(mini, change))
    assert result.status == 1
    found = result.replay.divergence
    assert (found.uid, found.number) == ("SkillerInterface::Skiller", 1)
    assert found.expected == "ExecSkill 'say{text=\"bye\", wait=true}'"
    assert found.actual == "ExecSkill 'say{text=\"hello\", wait=true}'"
    assert "expected ExecSkill 'say{text=\"bye\", wait=true}' (0." in result.reason


def test_gensym_ids_in_skill_strings_do_not_count(tmp_path: Path) -> None:
    agent = AGENT.replace('"hello"', '(str-cat "hello " (gensym*))')
    write_scenario(tmp_path, agent=agent)
    run_scenario(RunOptions(scenario=tmp_path, trace=tmp_path / "run.mcap"))
    (tmp_path / "mini.clp").write_text(
        agent.replace("(str-cat", "(gensym*) (str-cat")
        .replace("param-values (gensym*)", "param-values")
        .replace("(assert (plan (id P)", "(gensym*) (assert (plan (id P)")
    )
    assert replay(tmp_path / "run.mcap").status == 0


def test_unrecorded_skill_is_divergence(mini: Path) -> None:
    def change(event: Event) -> Event | None:
        return None if skill_of(event) or (isinstance(event, SkillStatus) and event.skill_string) else event

    result = replay(rewrite(mini, change))
    assert result.status == 1
    assert result.replay.divergence.expected == ""
    assert 'expected nothing more, got ExecSkill \'say{text="hello"' in result.reason


def test_missing_skill_is_divergence(mini: Path, tmp_path: Path) -> None:
    scenario = write_scenario(tmp_path / "other", agent=AGENT.replace("(mode FORMULATED)", "(mode FINISHED)"))
    result = replay(mini, scenario=scenario)
    assert result.status == 1
    assert "got nothing" in result.reason
    assert 60 < result.run_seconds < 70


def test_different_outcome_of_goal_is_shown(mini: Path) -> None:
    def change(event: Event) -> Event:
        if isinstance(event, GoalTransition) and event.outcome == "COMPLETED":
            return replace(event, outcome="FAILED")
        return event

    result = replay(rewrite(mini, change))
    assert result.status == 1
    assert not result.replay.same
    assert result.replay.divergence is None
    assert "FAILED" in "\n".join(result.replay.lines)
    assert result.replay.to_json()["same"] is False


# -- bad input


def test_truncated_mcap_is_compared_up_to_its_end(tmp_path: Path) -> None:
    trace = tmp_path / "run.mcap"
    run_scenario(RunOptions(scenario=SCENARIOS / "two-robots", trace=trace))
    data = trace.read_bytes()
    for part in (0.5, 0.8):
        trace.write_bytes(data[: int(len(data) * part)])
        result = replay(trace)
        assert result.status == 0, result.summary()
        assert not result.replay.is_complete


def test_recording_without_skills_needs_total_order(mini: Path) -> None:
    def change(event: Event) -> Event | None:
        late = isinstance(event, GoalTransition) and event.mode != "FORMULATED"
        return None if late or isinstance(event, (SkillStatus, PlanActionTransition)) else event

    cut = rewrite(mini, change)
    with pytest.raises(TraceError, match="ends before the first state of a Skiller"):
        replay(cut, order="partial")
    assert replay(cut).status == 0


def test_recording_without_decisions_is_an_error(mini: Path) -> None:
    writes = rewrite(mini, lambda event: event if isinstance(event, InterfaceWrite) else None)
    only = rewrite(writes, lambda event: None if skill_of(event) else event, "writes.mcap")
    with pytest.raises(TraceError, match="nothing to compare with"):
        replay(only, scenario=mini.parent)


def test_recording_without_environment_is_an_error(mini: Path, tmp_path: Path) -> None:
    text = tmp_path / "transitions.txt"
    assert invoke(["trace", "convert", str(mini), str(text), "--to", "transitions"]) == 0
    with pytest.raises(TraceError, match="no environment to replay"):
        replay(text, scenario=mini.parent)


@pytest.mark.parametrize("options", [{"skiller": "simulator"}, {"speech": "on"}, {"clock": "real"}])
def test_incompatible_options_are_an_error(options: dict[str, str], mini: Path) -> None:
    with pytest.raises(CxbridgeError, match="cannot be combined with --replay"):
        replay(mini, **options)


def test_command_prints_json(mini: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke(["run", str(mini.parent), "--replay", str(mini), "--json", "-q"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["status"], report["result"]) == (0, "the same")
    assert report["replay"]["same"] is True
    assert report["replay"]["divergence"] is None
    assert report["replay"]["comparison"]["same"] is True
    assert invoke(["run", "--replay", str(mini), "--replay-order", "odd"]) == 2


def test_recording_does_not_choose_foreign_scenario(mini: Path) -> None:
    """The recording names a scenario of this machine; only shipped scenarios are started by such a name."""
    with pytest.raises(TraceError, match="which a recording must not start"):
        run_scenario(RunOptions(replay=(mini,)))


def test_shipped_scenarios_need_no_name(tmp_path: Path) -> None:
    shipped = shipped_dir("scenarios") / "test-scenario"
    run_scenario(RunOptions(scenario=shipped, trace=tmp_path / "run.mcap"))
    assert run_scenario(RunOptions(replay=(tmp_path / "run.mcap",))).status == 0


@pytest.mark.parametrize("order", ["total", "partial"])
def test_different_parameter_is_divergence(mini: Path, order: str) -> None:
    def change_params(event: Event) -> Event:
        return replace(event, params="(odd)") if isinstance(event, PlanActionTransition) else event

    result = replay(rewrite(mini, change_params, f"odd-{order}.mcap"), order=order)
    assert result.status == 1
    assert any("params=(odd)" in line for line in result.replay.lines)
