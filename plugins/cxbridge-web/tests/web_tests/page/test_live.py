"""The page with a real daemon."""

from __future__ import annotations

from tests.support import ROOT
from web_tests.page.conftest import show_past_goals
from web_tests.support import serving

SCENARIO = ROOT / "scenarios" / "test-scenario"


def test_page_follows_test_scenario_to_end(tab):
    with serving((("clock", "scaled:3"),), config=SCENARIO) as (_, client, _lines):
        client.ask("POST", "/api/cxbridge/pause")  # the run waits for the page
        tab.goto(f"{client.url}/#/goals/gen14")
        tab.wait_for_selector("#state >> text=PAUSED")
        client.ask("POST", "/api/cxbridge/resume")
        tab.wait_for_selector("#goal .action >> text=say-hello-again")
        tab.click("#why")
        tab.wait_for_selector("#why-text >> text=gen14")
        tab.wait_for_selector("#goal .detail-head >> text=completed")
        assert tab.locator("#goal .action").filter(has_text="FINAL").count() == 5
        show_past_goals(tab)
        tab.wait_for_selector("[role=treeitem] >> text=FINALLY-SUCCEED-gen29")
        history = tab.locator("#goal .tl-steps").inner_text()
        modes = ("FORMULATED", "SELECTED", "EXPANDED", "COMMITTED", "DISPATCHED", "FINISHED", "EVALUATED")
        positions = [history.index(mode) for mode in modes]
        assert positions == sorted(positions)


def test_page_calls_skill_and_shows_its_end(tab):
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
