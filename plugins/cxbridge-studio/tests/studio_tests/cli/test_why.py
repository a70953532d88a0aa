"""The command `cxbridge why`."""

from __future__ import annotations

import json

import pytest

from cxbridge.cli.main import invoke
from cxbridge_studio.explain.rules.diagnoser import diagnose
from tests.run.mini import write_scenario
from tests.support import FAWKES_DIR, ROOT, SHARED, many, needs_fawkes, needs_shared

LOG = SHARED / "traces" / "test-scenario" / "skiller-1" / "fawkes.log"


@pytest.fixture(name="mini")
def _mini(tmp_path):
    return str(write_scenario(tmp_path / "mini"))


def run_why(capsys, *words):
    status = invoke(["why", *words])
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def test_rule_is_explained_at_time_of_run(mini, capsys):
    status, out, _ = run_why(capsys, "mini-evaluate", mini, "--at", "0.5")
    assert status == 0
    assert "rule mini-evaluate (" in out
    assert "mini.clp:23)" in out
    assert "Its condition does not match: condition 1 has no match." in out
    assert "mode is DISPATCHED, wanted FINISHED" in out


def test_rule_is_explained_at_end_of_run(mini, capsys):
    status, out, _ = run_why(capsys, "mini-evaluate", mini, "--json")
    answer = json.loads(out)
    assert status == 0
    assert answer["fired"] == 1
    assert answer["where"].startswith("mini at its end, ")
    assert answer["elements"][0]["joined"] == {"number": 0, "more": False}


def test_rule_fired_in_initialisation_has_time_of_firing(mini, capsys):
    out = run_why(capsys, "executive-init-start", mini, "--at", "0.5")[1]
    assert "It has fired once at 0.000 s" in out
    assert "Its condition matches in one way, and it has fired for it" in out


def test_waiting_and_finished_goals_are_explained(mini, capsys):
    assert 'action 1 act("hello") of G has been RUNNING since' in run_why(capsys, "G", mini, "--at", "0.5")[1]
    status, out, _ = run_why(capsys, "goal", "MINI", mini)
    assert status == 0
    assert "G (MINI) COMPLETED at" in out
    assert "1 of 1 actions are done" in out


def test_first_word_restricts_name_to_rule_or_goal(mini, capsys):
    assert run_why(capsys, "rule", "G", mini)[2] == ("cxbridge: error: there is no rule 'G'\n")
    assert "there is no goal 'mini-begin'" in run_why(capsys, "goal", "mini-begin", mini)[2]


@pytest.mark.parametrize("source", ["attached", "named"])
def test_explanation_of_recording_equals_explanation_of_run(source, mini, tmp_path, capsys):
    recording = str(tmp_path / "run.mcap")
    assert invoke(["run", mini, "--trace", recording, "--trace-level", "facts"]) == 0
    capsys.readouterr()
    live = run_why(capsys, "mini-retract", mini, "--at", "0.5")[1]
    scenario = [mini] if source == "named" else []
    recorded = run_why(capsys, "mini-retract", *scenario, "--run", recording, "--at", "0.5")[1]
    assert live.split("\n\n", 2)[2:] == recorded.split("\n\n", 2)[2:]


def test_damaged_recording_is_explained_or_an_error(mini, tmp_path, capsys):
    recording = tmp_path / "run.mcap"
    assert invoke(["run", mini, "--trace", str(recording), "--trace-level", "facts"]) == 0
    data = recording.read_bytes()
    for part in range(1, 20, many(1, 6)):
        damaged = bytearray(data[: len(data) * part // 20])
        damaged[len(damaged) * part // 25] ^= 0xFF
        recording.write_bytes(damaged)
        for name in ("mini-retract", "G"):
            capsys.readouterr()
            status, out, err = run_why(capsys, name, "--run", str(recording))
            assert (status, bool(out), "cxbridge: error: " in err) in ((0, True, False), (2, False, True))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["x", "SCENARIO", "--at", "soon"], "--at cannot be 'soon'"),
        (["x", "SCENARIO", "--at", "-1"], "--at cannot be '-1'"),
        (["x", "SCENARIO", "--at", "nan"], "--at cannot be 'nan'"),
        (["x", "SCENARIO", "more"], "too many: more"),
        (["x", "SCENARIO", "--env", "other"], "there is no CLIPS environment 'other'"),
        (["x", "no-such-scenario"], "there is no such scenario"),
        (["x", "--run", "no-such.mcap"], "cannot be read"),
        (["mini-begi", "SCENARIO"], "there is neither a rule nor a goal 'mini-begi'"),
    ],
)
def test_bad_input_is_a_single_error(words, message, mini, capsys):
    status, out, err = run_why(capsys, *(mini if word == "SCENARIO" else word for word in words))
    assert status == 2
    assert out == ""
    assert message in err
    assert "Traceback" not in err


@needs_shared
@needs_fawkes
def test_rule_of_fawkes_log_is_explained_with_checkout(capsys):
    assert FAWKES_DIR is not None
    options = ["--run", str(LOG), "--fawkes-dir", str(FAWKES_DIR), "--spec", "test", "--at", "4"]
    status, out, _ = run_why(capsys, "try-all-goal-commit", *options)
    assert status == 0
    assert "goals/try-all.clp:51)" in out
    assert ">         1      0                  0  ?gf <- (goal (id ?id) (type ACHIEVE)" in out
    assert "    mode is FORMULATED, wanted EXPANDED" in out


@needs_shared
@needs_fawkes
def test_match_before_recorded_firing_equals_firing(capsys):
    """Just before a recorded firing, the copied facts of the log have the match of the firing."""
    assert FAWKES_DIR is not None
    from cxbridge.events import RuleFired
    from cxbridge.trace.formats.registry import open_run

    start = next(iter(open_run(LOG))).time_us
    event = next(
        e for e in open_run(LOG) if isinstance(e, RuleFired) and e.rule == "talk-goal-evaluate-completed"
    )
    at = (event.time_us - start - 1) / 1e6
    options = [
        "--run",
        str(LOG),
        "--fawkes-dir",
        str(FAWKES_DIR),
        "--spec",
        "test",
        "--at",
        str(at),
        "--json",
    ]
    status, out, _ = run_why(capsys, event.rule, *options)
    assert status == 0
    assert event.basis in json.loads(out)["bases"]


def test_matches_of_every_fourth_rule_equal_counts_of_clips(monkeypatch):
    # in this process, because a sandbox for each rule would take long
    monkeypatch.setattr("cxbridge_studio.explain.rules.report.diagnose_in_sandbox", diagnose)
    from cxbridge.run import RunOptions
    from cxbridge_studio.explain.rules.report import explain_rule, format_report, to_json
    from cxbridge_studio.explain.scenario import collect_scenario_evidence

    with collect_scenario_evidence(RunOptions(scenario=ROOT / "scenarios" / "test-scenario"), 3) as evidence:
        rules = sorted(evidence.read_rulebook().rules)[::4]
        assert len(rules) > 50
        for rule in rules:
            story = explain_rule(evidence, rule)
            assert story.diagnosis is not None
            assert story.diagnosis.unknown == "", rule
            assert story.diagnosis.failure is None or story.diagnosis.failure.kind != "unknown", rule
            assert list(format_report(story))
            json.dumps(to_json(story))
            assert story.snapshot is not None
            has_simple_elements = all(
                not element.text.startswith(("(test", "(or", "(not (and"))
                for element in story.diagnosis.elements
            )
            clips_counts = [
                line
                for line in story.snapshot.clips_counts
                if line.startswith(f"CEs 1 - {len(story.diagnosis.elements)}:")
            ]
            if has_simple_elements and clips_counts:
                count = story.diagnosis.matches.number if story.diagnosis.matches else 0
                assert clips_counts == [f"CEs 1 - {len(story.diagnosis.elements)}: {count}"], rule
