"""Runs: ends, exit statuses and recordings."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.errors import BrokenAgentError, CxbridgeError
from cxbridge.events import SkillStatus
from cxbridge.run import RunOptions, run_scenario
from cxbridge.run.agent import make_base
from cxbridge.trace.formats.registry import open_run
from tests.run.mini import AGENT, write_scenario
from tests.support import FAWKES_DIR, ROOT, SHARED, many, needs_fawkes, needs_shared

TEST_SCENARIO = ROOT / "scenarios" / "test-scenario"
FINAL = "function execute() return skillenv.skill_status.S_FINAL end\nfunction reset() end"


def run(scenario, **options):
    lines: list[Any] = []
    result = run_scenario(RunOptions(scenario=scenario, **options), console=lines.append)
    return result, [line.text for line in lines]


def test_completed_run_has_status_0(tmp_path):
    result, _ = run(write_scenario(tmp_path))
    assert (result.status, result.reason) == (0, "every root goal ended COMPLETED")
    assert [(goal.goal, goal.outcome) for goal in result.goals] == [("G", "COMPLETED")]
    assert 0.5 < result.run_seconds < 10


def test_run_starts_at_time_0(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A simulation begins in 1970, where the initial time 0 of the last request for control is recent."""
    monkeypatch.setattr(VirtualClock.__init__, "__defaults__", (10_000,))
    result, _ = run(write_scenario(tmp_path))
    assert (result.status, result.reason) == (0, "every root goal ended COMPLETED")


def test_failed_goal_is_status_1(tmp_path):
    result, log = run(write_scenario(tmp_path, mapping="other: wait{}"))
    assert (result.status, result.reason) == (1, "G ended FAILED")
    assert result.goals[0].error == "ACTION-FAILED"
    assert any("No action executor for action 'act'" in text for text in log)


def test_timeout_is_status_3_with_open_goals(tmp_path):
    result, _ = run(write_scenario(tmp_path, mapping="act: wait{seconds=1000}"), timeout=5)
    assert result.status == 3
    assert result.reason == "not over: G is DISPATCHED after 5 s"
    assert 5 <= result.run_seconds < 5.1


def test_quit_with_open_goals_is_status_1(tmp_path):
    """Such a run was "completed": open goals have not failed."""
    bye = "(defrule bye (goal (id G) (mode DISPATCHED)) => (quit))"
    result, _ = run(write_scenario(tmp_path, agent=AGENT + bye))
    assert result.status == 1
    assert result.reason == "the agent quit before its root goals were over: G is DISPATCHED"
    assert result.to_json()["result"] == "unsuccessful"


def test_quit_after_all_goals_is_status_0(tmp_path):
    bye = "(defrule bye (not (goal)) (begun) => (quit))"
    result, _ = run(write_scenario(tmp_path, agent=AGENT + bye))
    assert (result.status, result.reason) == (0, "every root goal ended COMPLETED")


@pytest.mark.parametrize("core", ["builtin", pytest.param("fawkes", marks=needs_fawkes)])
@pytest.mark.parametrize(
    "made",
    [
        "(assert (goal (class A) (mode FINISHED) (outcome COMPLETED)))",
        "(goal-tree-assert-run-all A (assert (goal (class B))) (assert (goal (class C))))",
    ],
)
def test_goal_without_id_does_not_end_run(tmp_path, made, core):
    """``run`` ended in a RecursionError, or reported a goal nil that ended UNKNOWN."""
    agent = f"""(defrule begin (executive-initialized) (not (begun)) => (assert (begun)) {made})
        (defrule select ?g <- (goal (mode FORMULATED) (parent nil)) => (modify ?g (mode SELECTED)))
        (defrule expand ?g <- (goal (sub-type ~nil) (mode SELECTED)) => (modify ?g (mode EXPANDED)))
        (defrule leaf ?g <- (goal (sub-type nil) (mode SELECTED))
          => (modify ?g (mode FINISHED) (outcome COMPLETED)))
        (defrule evaluate ?g <- (goal (mode FINISHED)) => (modify ?g (mode EVALUATED)))
        (defrule retract ?g <- (goal (mode EVALUATED) (parent nil)) => (modify ?g (mode RETRACTED)))"""
    scenario = write_scenario(tmp_path, agent=agent)
    config = scenario / "scenario.yaml"
    config.write_text(config.read_text().replace("[mini.clp", "[goal-tree.clp, goals/run-all.clp, mini.clp"))
    result, _ = run(scenario, **({"fawkes_dir": FAWKES_DIR} if core == "fawkes" else {}))
    assert (result.status, result.reason) == (0, "every root goal ended COMPLETED")
    lines = result.goal_lines()
    assert all("COMPLETED" in line for line in lines)
    if "tree" in made:
        assert len(lines) == 3


def run_until_the_goal_is_dropped(directory, core, **options):
    """Run an agent that retracts its goal, plan and action while the action's skill runs."""
    drop = """(defrule drop
        ?g <- (goal (id G) (mode DISPATCHED)) ?p <- (plan) ?a <- (plan-action (state RUNNING))
        => (retract ?g ?a ?p))"""
    scenario = write_scenario(directory, agent=AGENT + drop, mapping="act: say{text=?(text)s, wait=true}")
    fawkes = {"fawkes_dir": FAWKES_DIR} if core == "fawkes" else {}
    result, _ = run(scenario, timeout=30, **fawkes, **options)
    return result


@pytest.mark.parametrize("core", ["builtin", pytest.param("fawkes", marks=needs_fawkes)])
@pytest.mark.parametrize("skiller", ["lua", "simulator"])
def test_dropped_goal_with_running_skill_ends_run(tmp_path, core, skiller):
    """Fawkes' rules leave a skill in S_RUNNING: the run waited for the skill until its timeout."""
    result = run_until_the_goal_is_dropped(tmp_path, core, skiller=skiller)
    assert (result.status, result.reason) == (1, "G ended UNKNOWN")
    assert result.run_seconds < 10


@pytest.mark.parametrize("core", ["builtin", pytest.param("fawkes", marks=needs_fawkes)])
def test_run_waits_for_stop_of_dropped_skill(tmp_path, core):
    """With the built-in core the run ended while rules still saw the skill run."""
    run_until_the_goal_is_dropped(tmp_path, core, trace=tmp_path / "run.mcap")
    statuses = [event.status for event in open_run(tmp_path / "run.mcap") if isinstance(event, SkillStatus)]
    assert statuses[-2:] == ["S_RUNNING", "S_INACTIVE"]


def test_second_configuration_overlays_first(tmp_path):
    """The second file replaced the first silently: values of the first file were lost."""
    scenario = write_scenario(tmp_path / "mini", mapping="other: wait{}")
    mapping = "clips-executive: {specs: {mini: {action-mapping: {act: '%s'}}}}"
    first, second = tmp_path / "first.yaml", tmp_path / "second.yaml"
    first.write_text(mapping % "wait{seconds=1}" + "\nother: {text: first}\n")
    second.write_text("other: {text: second}\n")
    result, _ = run(scenario, config=(first, second))
    assert (result.status, result.reason) == (0, "every root goal ended COMPLETED")
    context = make_base(RunOptions(scenario=scenario, config=(first, second)))
    assert context.config.get_str("/other/text") == "second"


def test_number_of_listed_goals_is_bounded(tmp_path, monkeypatch):
    monkeypatch.setattr("cxbridge.executive.goals.MAX_GOALS", 5)
    agent = """(defrule begin (executive-initialized) (not (begun)) => (assert (begun) (make 1)))
        (defrule make ?m <- (make ?n) (not (goal)) =>
          (retract ?m)
          (if (<= ?n 40) then (assert (make (+ ?n 1))))
          (assert (goal (id (sym-cat G ?n)) (mode RETRACTED) (outcome COMPLETED))))"""
    result, _ = run(write_scenario(tmp_path, agent=agent))
    assert [goal.goal for goal in result.goals] == ["G37", "G38", "G39", "G40", "G41"]
    assert (result.forgotten_goal_count, result.goal_lines()[0]) == (36, "(36 earlier goals are not listed)")


def test_runs_are_byte_identical_under_any_hash_seed(tmp_path):
    """Determinism: transitions, log and firings of the whole test scenario."""
    texts = set()
    for seed in range(many(20, 4)):
        log = tmp_path / f"{seed}.log"
        command = [sys.executable, "-m", "cxbridge", "run", str(TEST_SCENARIO), "-q", "--log", str(log)]
        subprocess.run(
            command, check=True, capture_output=True, env={**os.environ, "PYTHONHASHSEED": str(seed)}
        )
        texts.add(log.read_bytes())
    assert len(texts) == 1
    assert b"FIRE" in texts.pop()


# --- bad input: one clear error each, with its place -----------------------------------------------------


def bad(scenario, **options):
    with pytest.raises(CxbridgeError) as caught:
        run_scenario(RunOptions(scenario=scenario, **options))
    assert caught.value.exit_status == 2
    return caught.value


def test_shipped_scenarios_are_found_by_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(Path("test-scenario"))[0].status == 0
    shipped = ", ".join(sorted(file.parent.name for file in (ROOT / "scenarios").glob("*/scenario.yaml")))
    assert bad(Path("no-scenario")).hint == f"shipped with cxbridge: {shipped}"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"clock": "sundial"}, "unknown clock 'sundial'"),
        ({"skiller": "butler"}, "--skiller cannot be 'butler'"),
        ({"core": "apple"}, "--core cannot be 'apple'"),
        ({"core": "fawkes"}, "--core fawkes needs a Fawkes checkout"),
        ({"speech": "loud"}, "--speech cannot be 'loud'"),
        ({"trace_level": "all"}, "--trace-level cannot be 'all'"),
        ({"timeout": 0}, "--timeout cannot be 0"),
    ],
)
def test_invalid_options_are_errors(tmp_path, options, message):
    assert message in bad(write_scenario(tmp_path), **options).message


def test_lenient_run_continues_after_broken_construct(tmp_path):
    scenario = write_scenario(tmp_path, agent=AGENT + "\n(defrule broken (x) => (nope 1))\n")
    line = AGENT.count("\n") + 2
    result, log = run(scenario, strict=False)
    assert result.status == 0
    message = f"{scenario / 'mini.clp'}:{line}: defrule broken is not defined: Missing function declaration"
    assert any(text.startswith(message) for text in log)


def test_broken_constructs_are_status_2_with_places(tmp_path):
    """Without --strict the run continued, and reported at its end that no goal had appeared."""
    more = "\n(defrule broken (x) => (nope 1))\n(defrule worse (y) => (nope 2))\n"
    scenario = write_scenario(tmp_path, agent=AGENT + more)
    error = bad(scenario)
    assert isinstance(error, BrokenAgentError)
    line = AGENT.count("\n") + 2
    places = [(mistake.file, mistake.line) for mistake in error.mistakes]
    assert places == [(str(scenario / "mini.clp"), line), (str(scenario / "mini.clp"), line + 1)]
    assert str(error).splitlines()[-1] == "2 mistakes, the agent was not started"


LATER = """
(defrule mini-later (time ?now $?) (test (> ?now 1000000001)) => (load* "{file}"))
(defrule mini-signal (never) => (assert (executive-init-signal (id later))))
"""


def test_broken_file_during_initialisation_is_status_2(tmp_path):
    """--strict checked only once, before the first loop."""
    later = tmp_path / "later.clp"
    later.write_text("(defrule later\n")
    scenario = write_scenario(tmp_path, agent=AGENT + LATER.format(file=later))
    config = scenario / "scenario.yaml"
    config.write_text(
        config.read_text().replace("- name: agent", "- name: agent\n            wait-for: later")
    )
    error = bad(scenario)
    assert [(mistake.file, mistake.line) for mistake in error.mistakes] == [(str(later), 1)]
    assert error.message == "1 mistake, the agent was not started"


@needs_fawkes
@pytest.mark.parametrize(("strict", "ends"), [(None, True), (True, True), (False, False)])
def test_missing_file_of_spec_is_an_error(tmp_path, strict, ends):
    over = tmp_path / "over.yaml"
    over.write_text(
        "clips-executive/specs/test/init/stage-3:\n  - {name: goal, file: test-scenario/no-such-file.clp}\n"
    )
    options = RunOptions(fawkes_dir=FAWKES_DIR, spec="test", config=over, strict=strict, timeout=5)
    if not ends:
        assert run_scenario(options).goals == ()
        return
    with pytest.raises(BrokenAgentError) as caught:
        run_scenario(options)
    mistake = next(mistake for mistake in caught.value.mistakes if "no-such-file" in mistake.message)
    assert (mistake.file, mistake.line) == (str(over), 2)


# --- recordings ---------------------------------------------------------------------------------------------


@needs_shared
@pytest.mark.parametrize("recording", ["skiller-1", "skiller-2", "simulator-1"])
@pytest.mark.parametrize("kind", ["t.mcap", "t.log"])
def test_claim_2_our_scenario_has_recorded_transitions(tmp_path, recording, kind):
    from cxbridge.cli.main import invoke

    result, _ = run(TEST_SCENARIO, trace=tmp_path / "t.mcap", log=tmp_path / "t.log")
    assert result.status == 0
    recorded = SHARED / "traces" / "test-scenario" / recording / "fawkes.log"
    assert invoke(["trace", "diff", "--order", "partial", str(tmp_path / kind), str(recorded)]) == 0


def fawkes_run(tmp_path, recording, clock):
    """Compare a run of the original files with a recording: firings and transitions, in total order."""
    from cxbridge.cli.main import invoke

    log = tmp_path / "t.log"
    options = RunOptions(fawkes_dir=FAWKES_DIR, spec="test", clock=clock, log=log)
    assert run_scenario(options).status == 0
    recorded = SHARED / "traces" / "test-scenario" / recording / "fawkes.log"
    for level in ("rules", "transitions"):
        diff = ["trace", "diff", "--order", "total", "--level", level, str(log), str(recorded)]
        assert invoke(diff) == 0, level


@needs_shared
@needs_fawkes
@pytest.mark.parametrize("recording", ["skiller-1", "skiller-2"])
def test_claim_1_original_files_fire_recorded_rules(tmp_path, recording):
    fawkes_run(tmp_path, recording, "virtual")


@needs_shared
@needs_fawkes
def test_claim_1_in_real_time(tmp_path):
    fawkes_run(tmp_path, "skiller-1", "real")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full here")
def test_incomplete_recording_is_status_4_after_run(tmp_path):
    result, _ = run(write_scenario(tmp_path / "s"), log=Path("/dev/full"))
    assert result.status == 4
    assert result.reason.startswith(
        "every root goal ended COMPLETED, but the recording is incomplete: /dev/full"
    )


@pytest.mark.parametrize(("level", "kinds"), [("transitions", 0), ("rules", 1), ("facts", 2)])
def test_rules_and_facts_are_recorded_without_debugging(tmp_path, level, kinds):
    from cxbridge.events import FactChange, RuleFired
    from cxbridge.trace.formats.registry import open_run

    run(write_scenario(tmp_path / "s"), trace=tmp_path / "t.mcap", trace_level=level)
    events = list(open_run(tmp_path / "t.mcap"))
    rules = [event.rule for event in events if isinstance(event, RuleFired)]
    assert bool(rules) == (kinds >= 1)
    assert bool([event for event in events if isinstance(event, FactChange)]) == (kinds == 2)
    assert "time-retract" not in rules
    assert not rules or "mini-select" in rules
