"""A game with an executive for each robot, and tests that an agent runs itself."""

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
    found = options.play(3)
    assert found.is_over
    assert found.faults == ()
    assert sorted(found.robots) == ["Ann", "Bob"]
    # both robots fetch the only workpiece
    assert sorted(sum(work.failed.values()) for work in found.robots.values()) == [0, 1]
    (reason,) = (error for work in found.robots.values() for error in work.failed)
    assert reason == "there is no workpiece at C-BS OUTPUT"
    assert found.points == 5


def test_robots_without_names_get_some(options):
    configure(options, PARAMETERS.replace(", rcll: {route: {CYAN: {Ann: [], Bob: []}}}", ""))
    assert sorted(options.play(3).robots) == ["R-1", "R-2", "R-3"]


@pytest.mark.parametrize(("verdict", "status"), [("SUCCEEDED", 0), ("FAILED", 1)])
def test_the_agent_says_whether_its_tests_have_succeeded(options, capsys, verdict, status):
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
    found = json.loads(capsys.readouterr().out)
    assert found["simtest"] == verdict
    assert found["complete"]
    assert found["phase"] == "PRODUCTION"


def test_tests_without_a_verdict_are_not_complete(options):
    configure(options, SIMTEST)
    found = replace(options, simtest="FULL").play(3)
    assert not found.is_over
    assert found.simtest == ""


def test_an_agent_without_tests(options):
    with pytest.raises(CxbridgeError, match="the spec 'team' has no parameters/simtest"):
        replace(options, simtest="FULL").play(3)
