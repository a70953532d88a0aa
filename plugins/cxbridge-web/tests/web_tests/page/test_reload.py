"""The page's data come from the daemon: a page that is loaded again, or opened late, shows the same."""

from __future__ import annotations

import re

from tests.run.mini import write_scenario
from web_tests.support import serving

FIRED = ".detail >> text=/fired [0-9]+/"


def names(tab):
    """Return the shown states."""
    return tab.locator("#machine th[scope=row]").all_text_contents()


def test_a_page_that_is_opened_late_shows_the_graph_of_a_skill_that_nobody_saw(tab):
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
        assert "WAIT" in " ".join(names(tab)).upper()


def test_messages_that_came_before_the_view_was_opened_are_there(tab):
    """They were heard only while the view was open, but after a reload there all of them were."""
    with serving() as (_, client, _lines):
        tab.goto(f"{client.url}/#/goals")
        tab.wait_for_selector("#state >> text=RUNNING")
        client.ask("POST", "/api/skiller/call", {"skill_string": "wait{seconds=0.1}"})
        client.until("/api/skiller/skills/active", lambda answer: answer["status"] == "FINAL")
        tab.goto(f"{client.url}/#/blackboard/SkillerInterface%3A%3ASkiller")
        tab.wait_for_selector("#messages >> text=ExecSkillMessage")
        tab.reload()
        tab.wait_for_selector("#messages >> text=ExecSkillMessage")


def test_two_pages_tell_the_same_number_of_firings(browser, tab, tmp_path):
    """Each page counted for itself, from when it was opened."""
    with serving(config=write_scenario(tmp_path / "mini")) as (_, client, _lines):
        address = f"{client.url}/#/clips/rules/time-retract"
        tab.goto(address)
        tab.wait_for_selector(FIRED)
        client.until("/api/cxbridge/rules?name=time-retract", lambda rows: rows[0].get("firings", 0) > 50)
        other = browser.new_page()
        other.goto(address)
        other.wait_for_selector(FIRED)
        shown = other.locator(FIRED).inner_text()
        assert int(re.findall(r"fired (\d+)", shown)[0]) > 50
        other.close()
