"""The story that `cxbridge run` prints, and the lines of the log within."""

from __future__ import annotations

import io

import pytest

from cxbridge.cli.main import invoke
from cxbridge.cli.run_output import wants_colour
from cxbridge.events import GoalTransition, PlanActionTransition
from cxbridge.history.failure_reasons import MAX_FAILURES, MAX_LOOKUPS, FailureReasons
from tests.programs import Started
from tests.run.mini import AGENT, write_scenario
from tests.support import ROOT

PRINTS = """
(defrule print-a-lot
  (executive-init)
  =>
  (printout error "an error that the agent prints" crlf)
  (printout warn "a warning that the agent prints" crlf)
  (bind ?zero 0)
  (printout t (/ 1 ?zero) crlf)
)
"""
BROKEN = "(defrule broken (no-such-template (slot 1)) => (no-such-function))\n"


def run(*arguments, capsys):
    status = invoke(["run", *map(str, arguments)])
    captured = capsys.readouterr()
    return status, captured.out.splitlines(), captured.err


def test_story_has_ends_of_goals_tree_and_result(capsys):
    status, lines, errors = run("test-scenario", capsys=capsys)
    assert (status, errors) == (0, "")
    story = [line for line in lines if line.startswith("  ") and " s  " in line]
    assert len(story) == 21
    assert story[4] == "    5.0 s  completed  gen14 (TALK) in 5.0 s"
    assert story[0] == "    0.0 s  rejected   gen13 (ALWAYS-REJECT)"
    assert [line for line in story if line.endswith("sub-goal gen25 (ALWAYS-FAIL) failed")]
    assert lines[21] == "RUN-ONE-TESTGOAL-PARENT-gen32 (TESTGOAL-PARENT): COMPLETED"
    assert lines[22] == "├─ gen13 (ALWAYS-REJECT): REJECTED"
    assert lines[-2] == "      └─ FINALLY-SUCCEED-gen29 (PRINT): COMPLETED"
    assert lines[-1].startswith(
        "test: completed, every root goal ended COMPLETED; 10.1 s of the run's clock in "
    )


def test_story_names_failed_action_as_reason(tmp_path, capsys):
    scenario = write_scenario(tmp_path, mapping="act: fail{}")
    status, lines, _ = run(scenario, capsys=capsys)
    assert status == 1
    (line,) = [line for line in lines if " failed " in line and "G (MINI)" in line]
    assert ": action act hello failed: " in line


def test_reset_goal_ends_twice(tmp_path, capsys):
    again = """
(defrule mini-again
  (declare (salience 10))
  ?g <- (goal (id G) (mode FINISHED))
  (not (again))
  =>
  (assert (again))
  (plan-retract-all-for-goal G)
  (modify ?g (mode SELECTED) (outcome UNKNOWN) (committed-to nil)))
"""
    _, lines, _ = run(write_scenario(tmp_path, mapping="act: fail{}", agent=AGENT + again), capsys=capsys)
    assert len([line for line in lines if " failed " in line and "G (MINI)" in line]) == 2


def test_quiet_prints_result_only(tmp_path, capsys):
    scenario = write_scenario(tmp_path)
    _, lines, errors = run(scenario, "-q", capsys=capsys)
    assert (lines[0], len(lines), errors) == ("G (MINI): COMPLETED", 2, "")


def test_story_shows_errors_but_no_output_of_rules(tmp_path, capsys):
    scenario = write_scenario(tmp_path)
    (agent,) = scenario.glob("*.clp")
    agent.write_text(agent.read_text() + PRINTS + BROKEN)
    _, _, errors = run(scenario, capsys=capsys)
    assert "that the agent prints" not in errors
    assert f"{agent.name}:" in errors
    assert "broken" in errors, "a broken construct"
    assert "divide by zero" in errors, "CLIPS' own report"
    _, _, errors = run(scenario, "-v", capsys=capsys)
    assert "E CLIPS (executive): an error that the agent prints" in errors
    assert "W CLIPS (executive): a warning that the agent prints" in errors
    log = tmp_path / "run.log"
    run(scenario, "--log", log, capsys=capsys)
    assert "an error that the agent prints" in log.read_text()


def test_terminal_gets_colours_and_icons(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    _, lines, _ = run(write_scenario(tmp_path), capsys=capsys)
    assert "\x1b[32m✓ completed\x1b[0m" in lines[0]
    assert "\x1b[32mCOMPLETED\x1b[0m" in lines[1]


class Stream(io.StringIO):
    def __init__(self, tty):
        super().__init__()
        self._tty = tty

    def isatty(self):
        return self._tty


@pytest.mark.parametrize(
    ("tty", "environ", "coloured"),
    [
        (True, {}, True),
        (False, {}, False),
        (True, {"NO_COLOR": "1"}, False),
        (True, {"NO_COLOR": ""}, True),
        (False, {"FORCE_COLOR": "1"}, True),
        (True, {"FORCE_COLOR": "0"}, False),
        (True, {"FORCE_COLOR": "1", "NO_COLOR": "1"}, False),
        (True, {"TERM": "dumb"}, False),
    ],
)
def test_colours_depend_on_terminal_and_environment(tty, environ, coloured):
    assert wants_colour(Stream(tty), environ) is coloured


def goal(name, mode, outcome="UNKNOWN", parent="nil", error=""):
    return GoalTransition(0, "executive", name, "C", "nil", parent, mode, outcome, error)


class TestFailureReasons:
    def test_facts_give_parameters_and_reason_of_failure(self):
        facts = {
            "plan-action": [
                {"goal-id": "G", "plan-id": "P", "id": 1, "param-values": ("book",), "error-msg": "slipped"}
            ]
        }
        reasons = FailureReasons(lambda template: facts.get(template, ()))
        reasons.record_event(PlanActionTransition(0, "executive", "1", "G", "P", "pick", "FAILED"))
        failed = goal("G", "FINISHED", "FAILED", error="ACTION-FAILED")
        reasons.record_event(failed)
        assert reasons.find_failure_reason(failed) == "action pick book failed: slipped"

    def test_reset_goal_has_no_failed_action(self):
        reasons = FailureReasons(lambda _: ())
        reasons.record_event(PlanActionTransition(0, "executive", "1", "G", "P", "pick", "FAILED"))
        reasons.record_event(goal("G", "FINISHED", "FAILED"))
        reasons.record_event(goal("G", "SELECTED"))
        assert reasons.find_failure_reason(goal("G", "FINISHED", "FAILED")) == ""

    def test_many_failures_cost_little_memory_and_few_lookups(self):
        looks: list[str] = []

        def look(template):
            looks.append(template)
            return ()

        reasons = FailureReasons(look)
        for number in range(3 * MAX_FAILURES):
            failed = goal(f"g{number}", "FINISHED", "FAILED", parent=f"p{number}", error="TIMEOUT")
            reasons.record_event(failed)
            assert reasons.find_failure_reason(failed) == "TIMEOUT"
        assert len(looks) == MAX_LOOKUPS
        assert len(reasons._failed_sub_goals) == MAX_FAILURES


def test_closed_stdout_ends_run_silently():
    """Goals end within calls of CLIPS, whose exceptions are no exceptions of the run."""
    scenario = ROOT / "scenarios" / "workshop"
    process = Started("run", scenario)
    assert "completed" in process.stdout.readline()
    process.stdout.close()
    _, said = process.communicate(60)
    assert (process.returncode, said) == (0, "")
