"""The page with a real daemon: the test scenario live, a skill, a fact, pause, and a recording of a run."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.run.mini import write_scenario
from tests.support import ROOT
from web_tests.page.conftest import show_gone
from web_tests.support import serving

SCENARIO = ROOT / "scenarios" / "test-scenario"


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """The test scenario, recorded."""
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    command = ["-m", "cxbridge", "run", str(SCENARIO), "--trace-level", "facts", "--trace", str(path)]
    subprocess.run([sys.executable, *command], check=True, capture_output=True, timeout=120)
    return path


def test_the_test_scenario_is_watched_from_begin_to_end(tab):
    with serving((("clock", "scaled:3"),), config=SCENARIO) as (_, client, _lines):
        client.ask("POST", "/api/cxbridge/pause")  # nothing happens before the page is loaded
        tab.goto(f"{client.url}/#/goals/gen14")
        tab.wait_for_selector("#state >> text=PAUSED")
        client.ask("POST", "/api/cxbridge/resume")
        tab.wait_for_selector("#goal .action >> text=say-hello-again")
        tab.click("#why")
        tab.wait_for_selector("#why-text >> text=gen14")
        tab.wait_for_selector("#goal .detail-head >> text=completed")
        assert tab.locator("#goal .action").filter(has_text="FINAL").count() == 5
        show_gone(tab)
        tab.wait_for_selector("[role=treeitem] >> text=FINALLY-SUCCEED-gen29")
        history = tab.locator("#goal .tl-steps").inner_text()
        modes = ("FORMULATED", "SELECTED", "EXPANDED", "COMMITTED", "DISPATCHED", "FINISHED", "EVALUATED")
        places = [history.index(mode) for mode in modes]
        assert places == sorted(places)


def test_a_paused_daemon_stands_still_until_it_is_resumed(tab):
    with serving(config=SCENARIO) as (_, client, _lines):
        tab.goto(f"{client.url}/#/goals")
        tab.wait_for_selector("[role=treeitem] >> text=gen14")
        tab.click("#pause")
        tab.wait_for_selector("#state >> text=PAUSED")
        assert client.get("/api/cxbridge/status").json["state"] == "PAUSED"
        tab.click("#pause >> text=Resume")
        tab.wait_for_selector("#state >> text=RUNNING")


def test_a_skill_is_called_drawn_and_seen_to_end(tab):
    with serving() as (_, client, _lines):
        tab.goto(f"{client.url}/#/skills")
        tab.wait_for_selector("[role=option] >> text=say")
        tab.fill("#skill-string", "wait{seconds=1.5}")
        tab.keyboard.press("Enter")
        tab.wait_for_selector("svg.graph .node.active text")
        tab.wait_for_selector("#skill-now >> text=FINAL")
        assert tab.locator("#calls li").count() == 1
        tab.click("[role=option] >> text=moveto")
        tab.wait_for_selector("h3 >> text=Skill moveto")
        tab.wait_for_selector("svg.graph .node text >> nth=2")


def test_a_skiller_of_somebody_else_is_left_alone(tab):
    with serving(config=SCENARIO) as (_, client, _lines):
        tab.goto(f"{client.url}/#/skills")
        tab.wait_for_selector("#calls li")
        tab.wait_for_selector("#held >> text=Executive controls this Skiller")
        assert tab.get_by_role("button", name="Call", exact=True).is_disabled()


@pytest.mark.smoke
def test_a_fact_is_asserted_changed_and_retracted(tab, tmp_path):
    with serving(config=write_scenario(tmp_path / "mini")) as (_, client, _lines):
        tab.goto(f"{client.url}/#/clips/facts")
        tab.fill("#new-fact", "(door hall open)")
        tab.keyboard.press("Enter")
        tab.fill(".find", "door hall")
        tab.click("[role=option] >> text=hall open")
        tab.fill("#edit-fact textarea", "(door hall shut)")
        tab.click("#edit-fact >> text=Change")
        tab.click("[role=option] >> text=hall shut")
        tab.fill("#edit-fact textarea", "(door hall")
        tab.click("#edit-fact >> text=Change")
        tab.wait_for_selector(".toast.bad")
        tab.click("[role=option] >> text=hall shut")
        tab.click("#edit-fact >> text=Retract")
        tab.wait_for_selector("text=Nothing matches")
        facts = client.get("/api/clips/executive/facts?formatted=true").json
        assert not [each for each in facts if each["template_name"] == "door"]
        tab.fill(".find", "(name act)")
        tab.click("[role=option] >> text=(name act)")
        tab.get_by_label("wait-sensed").fill("FALSE")
        tab.click("#edit-fact >> text=Change")
        tab.wait_for_selector("[role=option].selected >> text=(wait-sensed FALSE)")


def test_each_skiller_of_two_robots_can_be_looked_at_and_the_graph_names_them(tab):
    with serving(config=ROOT / "scenarios" / "two-robots") as (_, client, _lines):
        tab.goto(f"{client.url}/#/skills")
        tab.select_option("#skiller", "robot1")
        tab.wait_for_selector("#calls li >> text=move{to=")
        tab.wait_for_selector("#executors tr:has-text('robot2') >> text=robot2-camera")
        tab.wait_for_selector("[role=option]:has-text('inspect') >> text=robot1-camera")
        tab.wait_for_selector("#skill-now dd >> text=executive")
        tab.click("[role=option] >> text=inspect")
        tab.wait_for_selector("#skill-form label >> text=place")
        tab.select_option("#skiller", "Skiller")
        tab.wait_for_selector("[role=option] >> text=say")
        tab.fill("#skill-string", "wait{seconds=0.5}")
        tab.keyboard.press("Enter")
        tab.wait_for_selector("#calls li >> text=wait{seconds=0.5}")
        assert tab.locator("#calls li >> text=move{to=").count() == 0
        tab.goto(f"{client.url}/#/blackboard/graph")
        tab.wait_for_selector("svg.graph a:has-text('SkillerInterface::robot2')")
        tab.fill(".find", "robot2")
        tab.wait_for_selector("svg.graph:not(:has(a:has-text('SkillerInterface::robot1')))")
        tab.click("svg.graph a:has-text('SkillerInterface::robot2') rect")
        tab.wait_for_selector(".detail h2:text-is('robot2')")


def test_values_of_interfaces_and_a_message(tab):
    with serving() as (_, client, _lines):
        tab.goto(f"{client.url}/#/blackboard")
        tab.click("[role=option] >> text=ComponentInterface >> nth=0")
        tab.wait_for_selector("#values td >> text=ACTIVE")
        tab.fill(".find", "DaemonInterface")
        tab.click("[role=option] >> text=DaemonInterface")
        tab.select_option("#message select", "PauseMessage")
        tab.click("#message button")
        tab.wait_for_selector("#values td >> text=PAUSED")
        tab.wait_for_selector("#state >> text=PAUSED")


def test_a_recording_is_opened_and_scrubbed(tab, recording):
    with serving() as (_, client, _lines):
        tab.goto(f"{client.url}/#/goals")
        with tab.expect_file_chooser() as chooser:
            tab.click("#open-recording")
        chooser.value.set_files(recording)
        tab.wait_for_selector("#state >> text=RECORDING")
        tab.wait_for_selector("[role=treeitem] >> text=completed")
        tab.locator("#moment").fill("100")
        tab.wait_for_selector("[role=treeitem] >> text=gen14")
        tab.click("[role=treeitem] >> text=gen14")
        tab.wait_for_selector("#goal .action >> text=say-hello")
        tab.keyboard.press("3")
        tab.wait_for_selector("svg.graph .node text >> nth=1")
        tab.keyboard.press("7")
        tab.wait_for_selector("h2:has-text('CLIPS')")
        tab.fill(".find", "domain-fact")
        tab.wait_for_selector("[role=option] >> text=said")
        tab.keyboard.press("Escape")
        tab.keyboard.press("4")
        tab.wait_for_selector("[role=option] >> text=SkillerInterface")
        tab.click("#to-live")
        tab.wait_for_selector("#state >> text=RUNNING")
