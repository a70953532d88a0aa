"""Reloaded and late pages show the data of the daemon."""

from __future__ import annotations

import re

from tests.run.mini import write_scenario
from web_tests.support import serving

FIRED = ".detail >> text=/fired [0-9]+/"


def state_names(tab):
    """Return the shown states."""
    return tab.locator("#machine th[scope=row]").all_text_contents()


def test_late_page_shows_graph_of_finished_skill(tab):
    with serving() as (_, client, _lines):
        client.ask("POST", "/api/skiller/call", {"skill_string": "wait{seconds=0.2}"})
        client.until("/api/skiller/skills/active", lambda answer: answer["status"] == "FINAL")
        first = client.get("/api/skiller/skills/active").json["graph"]
        assert first.startswith("digraph")
        client.get("/api/skiller/skills")
        client.get("/api/skiller/skills/moveto")
        assert client.get("/api/skiller/skills/active").json["graph"] == first
        tab.goto(f"{client.url}/#/skills")
        tab.wait_for_selector("#machine tr")
        assert "WAIT" in " ".join(state_names(tab)).upper()


def test_late_view_shows_earlier_messages(tab):
    """The page collects messages for views that are not open."""
    with serving() as (_, client, _lines):
        tab.goto(f"{client.url}/#/goals")
        tab.wait_for_selector("#state >> text=RUNNING")
        client.ask("POST", "/api/skiller/call", {"skill_string": "wait{seconds=0.1}"})
        client.until("/api/skiller/skills/active", lambda answer: answer["status"] == "FINAL")
        tab.goto(f"{client.url}/#/blackboard/SkillerInterface%3A%3ASkiller")
        tab.wait_for_selector("#messages >> text=ExecSkillMessage")
        tab.reload()
        tab.wait_for_selector("#messages >> text=ExecSkillMessage")


def test_late_page_shows_all_firings_of_rule(browser, tab, tmp_path):
    """The daemon counts the firings, not the page."""
    with serving(config=write_scenario(tmp_path / "mini")) as (_, client, _lines):
        address = f"{client.url}/#/clips/rules/time-retract"
        tab.goto(address)
        tab.wait_for_selector(FIRED)
        client.until("/api/cxbridge/rules?name=time-retract", lambda rows: rows[0].get("firings", 0) > 50)
        late_page = browser.new_page()
        late_page.goto(address)
        late_page.wait_for_selector(FIRED)
        shown = late_page.locator(FIRED).inner_text()
        assert int(re.findall(r"fired (\d+)", shown)[0]) > 50
        late_page.close()
