"""The page with a real daemon: the test scenario live, a skill, a fact, pause, and a recording of a run."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.support import ROOT
from web_tests.page.conftest import show_gone, wait_for
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
        tab.wait_for_selector("#machine tr.active")
        tab.wait_for_selector("#skill-now >> text=FINAL")
        assert tab.locator("#calls li").count() == 1
        tab.wait_for_selector("#machine .taken")
        tab.click("[role=option] >> text=moveto")
        tab.wait_for_selector("h3 >> text=Calls of moveto")
        assert tab.input_value("#skill-string") == "moveto{}"


def test_a_skiller_of_somebody_else_is_left_alone(tab):
    with serving(config=SCENARIO) as (_, client, _lines):
        tab.goto(f"{client.url}/#/skills")
        tab.wait_for_selector("#calls li")
        tab.wait_for_selector("#held >> text=The executive or another client")
        assert tab.get_by_role("button", name="Call", exact=True).is_disabled()


def test_each_skiller_of_two_robots_can_be_looked_at(tab):
    with serving(config=ROOT / "scenarios" / "two-robots") as (_, client, _lines):
        tab.goto(f"{client.url}/#/skills")
        tab.select_option("#skiller", "robot1")
        tab.wait_for_selector("#calls li >> text=move{to=")
        tab.wait_for_selector("[role=option]:has-text('inspect') >> text=robot1-camera")
        tab.click("[role=option] >> text=inspect")
        wait_for(tab, lambda: tab.input_value("#skill-string").startswith("inspect{"))
        tab.select_option("#skiller", "Skiller")
        tab.wait_for_selector("[role=option] >> text=say")
        tab.fill("#skill-string", "wait{seconds=0.5}")
        tab.keyboard.press("Enter")
        tab.wait_for_selector("#calls li >> text=wait{seconds=0.5}")
        assert tab.locator("#calls li >> text=move{to=").count() == 0


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
        tab.wait_for_selector("#machine tr >> nth=1")
        tab.keyboard.press("7")
        tab.wait_for_selector("h2:has-text('CLIPS')")
        tab.fill(".find", "domain-fact")
        tab.wait_for_selector("[role=option] >> text=said")
        tab.keyboard.press("Escape")
        tab.keyboard.press("4")
        tab.wait_for_selector("[role=option] >> text=SkillerInterface")
        tab.click("#to-live")
        tab.wait_for_selector("#state >> text=RUNNING")
