"""`cxbridge coverage` as a person calls it."""

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


def ask(capsys, *words):
    capsys.readouterr()
    status = invoke(["coverage", *map(str, words)])
    done = capsys.readouterr()
    return status, done.out, done.err


def test_what_is_told(recording, capsys):
    status, out, _ = ask(capsys, recording)
    assert status == 0
    assert out.startswith("7 of 8 rules fired in 1 run: 87.5 %")
    assert "mini.clp:25 never" in out
    assert "goal classes: 1 of 1 appeared" in out


def test_the_named_scenario_is_like_the_recorded_one(mini, recording, capsys):
    assert ask(capsys, recording)[1] == ask(capsys, recording, "--scenario", mini)[1]
    both = json.loads(ask(capsys, recording, recording, "--scenario", mini, "--core", "--json")[1])
    assert both["runs"] == 2
    assert both["rules"]["total"] > 100


def test_too_little(recording, capsys):
    assert ask(capsys, recording, "--fail-under", "87.5")[0] == 0
    assert ask(capsys, recording, "--fail-under", "87.6")[0] == 1


def test_the_tracefile(recording, tmp_path, capsys):
    assert ask(capsys, recording, "--lcov", tmp_path / "c.info")[0] == 0
    text = (tmp_path / "c.info").read_text()
    assert "FNF:8\nFNH:7\n" in text


def test_a_run_without_firings(mini, tmp_path, capsys):
    file = tmp_path / "run.mcap"
    assert invoke(["run", str(mini), "--trace", str(file)]) == 0
    status, out, _ = ask(capsys, file)
    assert status == 0
    assert out.startswith("which rules fired in 1 run was not recorded: record with --trace-level rules")
    for option in (["--fail-under", "10"], ["--lcov", tmp_path / "c.info"]):
        status, _, err = ask(capsys, file, *option)
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
def test_bad_input_is_one_error(words, message, recording, capsys):
    status, out, err = ask(capsys, *(recording if word == "RUN" else word for word in words))
    assert status == 2
    assert out == ""
    assert message in err


@needs_shared
def test_a_log_alone_does_not_know_what_there_is(capsys):
    status, _, err = ask(capsys, LOG)
    assert status == 2
    assert "--fawkes-dir" in err


@needs_shared
@needs_fawkes
def test_a_log_of_fawkes_with_the_checkout(capsys):
    status, out, _ = ask(capsys, LOG, "--fawkes-dir", FAWKES_DIR, "--spec", "test")
    assert status == 0
    assert out.startswith("123 of 211 rules fired in 1 run: 58.3 %")
    assert "domain.clp:1031 domain-action-failed" in out
