"""The command `cxbridge coverage`."""

from __future__ import annotations

import json

import pytest

from cxbridge.cli.main import invoke
from tests.run.mini import AGENT, write_scenario
from tests.support import FAWKES_DIR, SHARED, needs_fawkes, needs_shared

LOG = SHARED / "traces" / "test-scenario" / "skiller-1" / "fawkes.log"


@pytest.fixture(name="mini", scope="module")
def _mini(tmp_path_factory):
    return write_scenario(
        tmp_path_factory.mktemp("scenario") / "mini", agent=AGENT + "(defrule never (no) =>)"
    )


@pytest.fixture(name="recording", scope="module")
def _recording(mini, tmp_path_factory):
    file = tmp_path_factory.mktemp("runs") / "run.mcap"
    assert invoke(["run", str(mini), "--trace", str(file), "--trace-level", "rules"]) == 0
    return file


def run_coverage(capsys, *words):
    capsys.readouterr()
    status = invoke(["coverage", *map(str, words)])
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def test_report_has_rules_and_goal_classes(recording, capsys):
    status, out, _ = run_coverage(capsys, recording)
    assert status == 0
    assert out.startswith("7 of 8 rules fired in 1 run: 87.5 %")
    assert "mini.clp:25 never" in out
    assert "goal classes: 1 of 1 appeared" in out


def test_named_scenario_has_same_report_as_recorded_scenario(mini, recording, capsys):
    assert run_coverage(capsys, recording)[1] == run_coverage(capsys, recording, "--scenario", mini)[1]
    both = json.loads(run_coverage(capsys, recording, recording, "--scenario", mini, "--core", "--json")[1])
    assert both["runs"] == 2
    assert both["rules"]["total"] > 100


def test_low_coverage_fails_with_fail_under(recording, capsys):
    assert run_coverage(capsys, recording, "--fail-under", "87.5")[0] == 0
    assert run_coverage(capsys, recording, "--fail-under", "87.6")[0] == 1


def test_lcov_file_is_written(recording, tmp_path, capsys):
    assert run_coverage(capsys, recording, "--lcov", tmp_path / "c.info")[0] == 0
    text = (tmp_path / "c.info").read_text()
    assert "FNF:8\nFNH:7\n" in text


def test_run_without_recorded_firings_has_no_coverage(mini, tmp_path, capsys):
    file = tmp_path / "run.mcap"
    assert invoke(["run", str(mini), "--trace", str(file)]) == 0
    status, out, _ = run_coverage(capsys, file)
    assert status == 0
    assert out.startswith("which rules fired in 1 run was not recorded: record with --trace-level rules")
    for option in (["--fail-under", "10"], ["--lcov", tmp_path / "c.info"]):
        status, _, err = run_coverage(capsys, file, *option)
        assert status == 2
        assert "no firings are recorded" in err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["RUN", "--fail-under", "101"], "--fail-under cannot be 101"),
        (["RUN", "--files", "none*"], "no file with rules matches none*"),
        (["RUN", "no-such-run"], "cannot be read"),
        (["RUN", "--lcov", "/dev/null/c.info"], "/dev/null/c.info"),
    ],
)
def test_bad_input_is_a_single_error(words, message, recording, capsys):
    status, out, err = run_coverage(capsys, *(recording if word == "RUN" else word for word in words))
    assert status == 2
    assert out == ""
    assert message in err


@needs_shared
def test_log_without_checkout_is_an_error(capsys):
    status, _, err = run_coverage(capsys, LOG)
    assert status == 2
    assert "--fawkes-dir" in err


@needs_shared
@needs_fawkes
def test_fawkes_log_with_checkout_has_coverage(capsys):
    status, out, _ = run_coverage(capsys, LOG, "--fawkes-dir", FAWKES_DIR, "--spec", "test")
    assert status == 0
    assert out.startswith("123 of 211 rules fired in 1 run: 58.3 %")
    assert "domain.clp:1031 domain-action-failed" in out
