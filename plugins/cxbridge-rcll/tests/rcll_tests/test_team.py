"""Games with an executive for each robot, and simulation tests of an agent."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from cxbridge.cli.main import invoke
from cxbridge.errors import CxbridgeError
from cxbridge.run.options import RunOptions
from cxbridge_rcll.game import LeagueGame
from rcll_tests.league import AGENT, write_refbox, write_team

TEAM = AGENT.replace("/robot1/Skiller", "Skiller")

PARAMETERS = """    team:
      parameters: {coordination: {mutex: {}}, rcll: {route: {CYAN: {Ann: [], Bob: []}}}}
"""

SIMTEST = """    team:
      parameters: {simtest: {enabled: false, testbed: FULL}}
"""

TESTS = """
(defrule test-begin (confval (path "/clips-executive/specs/team/parameters/simtest/testbed") (value "%s"))
  (protobuf-msg (type "llsf_msgs.GameState") (ptr ?p)) (test (eq (pb-field-value ?p "phase") "PRODUCTION")) =>
  (printout info "SIMTEST: %s" crlf) (quit))
"""


@pytest.fixture
def options(tmp_path):
    run = RunOptions(overlays=(write_team(tmp_path / "team", TEAM),))
    return LeagueGame(run_options=run, refbox_dir=write_refbox(tmp_path / "refbox"), minutes=1)


def configure(options, parameters):
    scenario = options.run_options.overlays[0] / "cfg/rcll-simulator/central_agent.yaml"
    scenario.write_text(scenario.read_text().replace("    team:\n", parameters))


def test_each_robot_has_an_executive(options):
    configure(options, PARAMETERS)
    result = options.play(3)
    assert result.is_over
    assert result.faults == ()
    assert sorted(result.robots) == ["Ann", "Bob"]
    # both robots fetch the only workpiece
    assert sorted(sum(work.failed.values()) for work in result.robots.values()) == [0, 1]
    (reason,) = (error for work in result.robots.values() for error in work.failed)
    assert reason == "there is no workpiece at C-BS OUTPUT"
    assert result.points == 5


def test_robots_get_default_names(options):
    configure(options, PARAMETERS.replace(", rcll: {route: {CYAN: {Ann: [], Bob: []}}}", ""))
    assert sorted(options.play(3).robots) == ["R-1", "R-2", "R-3"]


@pytest.mark.parametrize(("verdict", "status"), [("SUCCEEDED", 0), ("FAILED", 1)])
def test_verdict_of_simulation_test_sets_status(options, capsys, verdict, status):
    configure(options, SIMTEST)
    agent = options.run_options.overlays[0] / "src/clips-specs/team.clp"
    agent.write_text(AGENT + TESTS % ("FULL", verdict))
    words = [
        "game",
        "--overlay",
        str(options.run_options.overlays[0]),
        "--refbox-dir",
        str(options.refbox_dir),
    ]
    assert invoke([*words, "--minutes", "5", "--simtest", "FULL", "--json"]) == status
    result = json.loads(capsys.readouterr().out)
    assert result["simtest"] == verdict
    assert result["complete"]
    assert result["phase"] == "PRODUCTION"


def test_simulation_test_without_verdict_is_incomplete(options):
    configure(options, SIMTEST)
    result = replace(options, simtest="FULL").play(3)
    assert not result.is_over
    assert result.simtest == ""


def test_agent_without_simulation_tests_is_error(options):
    with pytest.raises(CxbridgeError, match="the spec 'team' has no parameters/simtest"):
        replace(options, simtest="FULL").play(3)
