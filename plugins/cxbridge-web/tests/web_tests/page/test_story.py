"""The questions with which the page is opened: state, failure and cause, a stuck run, a stop, a link."""

from __future__ import annotations

import json
from typing import Any

import pytest

from cxbridge_web.report import report
from tests.trace.runs import MemoryRun, goal
from web_tests.page.conftest import PHONE, wait_for
from web_tests.page.fake import START_US, FakeDaemon, Served, goal_event
from web_tests.page.test_timeline import SECOND, SKILL, at, failure

ONE_HAND = 0.45
"""The part of a telephone's height, from its lower edge, that the thumb of the hand that holds it reaches."""


@pytest.mark.smoke
def test_what_it_does_now_and_what_is_late(tab: Any, site: Served, daemon: FakeDaemon):
    move = SKILL | {"skill_string": 'move{to="hall"}', "msgid": 1}
    daemon.tell(
        *at(0, goal_event("TOUR", "DISPATCHED"), move | {"status": "S_RUNNING"}),
        *at(6, move | {"status": "S_FINAL"}),
        *at(7, SKILL | {"status": "S_RUNNING"}),
    )
    tab.goto(site.url)  # the clock of the daemon is at 60 s
    tab.wait_for_selector(".story-head >> text=Running for 1 min")
    now = tab.locator(".story section:has(h3:text-is('Now')) li")
    wait_for(tab, lambda: 'robot1 move{to="lab"} for 53' in now.inner_text())
    assert "late: at most 6.0 s before" in now.inner_text()
    late = "[...document.querySelector('.tl').timeline.late].map(({ text }) => text)"
    wait_for(tab, lambda: tab.evaluate(late) == ['move{to="lab"}'])  # looked for twice a second


@pytest.mark.smoke
def test_a_telephone_answers_with_one_hand(tab: Any, site: Served, daemon: FakeDaemon):
    """State, present skills, failure and its cause need no touch; a stop needs one, where the thumb is."""
    tab.set_viewport_size(PHONE)
    daemon.tell(*failure(), *at(9, SKILL | {"status": "S_RUNNING", "msgid": 4}))
    tab.goto(site.url)
    tab.wait_for_selector("#state >> text=RUNNING")
    tab.wait_for_selector('.story-head >> text=robot1 could not do move{to="lab"}')
    tab.wait_for_selector(".story section:has(h3:text-is('Now')) >> text=robot1")
    for place in ("#pause", "#nav a[data-view=goals]"):
        box = tab.locator(place).bounding_box()
        assert box["y"] > PHONE["height"] * (1 - ONE_HAND), place
        assert box["height"] >= 40, place
    tab.click("#pause")
    tab.wait_for_selector("#state >> text=PAUSED")
    assert daemon.count("POST", "cxbridge/pause") == 1
    assert tab.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]


def test_a_moment_is_sent_to_a_colleague(browser: Any, site: Served, daemon: FakeDaemon):
    daemon.files["run.jsonl"] = "\n".join(map(json.dumps, failure())).encode()
    context = browser.new_context(permissions=["clipboard-read", "clipboard-write"])
    mine = context.new_page()
    mine.goto(f"{site.url}?run=files/run.jsonl#/goals?outcome=failed")
    mine.click("[role=treeitem] >> text=FETCH")
    mine.keyboard.press(",")
    mine.keyboard.press("l")
    mine.wait_for_selector("text=is copied")
    address = mine.evaluate("navigator.clipboard.readText()")
    told = mine.inner_text("#told")
    yours = context.new_page()
    yours.goto(address)
    yours.wait_for_selector("#goal h2:text-is('FETCH')")
    yours.wait_for_selector(f"#told >> text={told.split('·')[1].split(',')[0].strip()}")
    assert yours.get_by_label("outcome", exact=True).input_value() == "failed"
    context.close()


@pytest.mark.smoke
def test_a_report_opens_at_the_failure(tab: Any, site: Served, daemon: FakeDaemon):
    run = [
        goal("TOUR", "DISPATCHED", time_us=START_US),
        goal("TOUR", "FINISHED", "FAILED", time_us=START_US + 3 * SECOND),
        goal("OTHER", "FINISHED", "COMPLETED", time_us=START_US + 9 * SECOND),
    ]
    daemon.files["run.html"] = report(MemoryRun(run), "A run").encode()
    tab.goto(f"{site.url}files/run.html")
    tab.wait_for_selector(".story-head >> text=Failed after 9.0 s")
    tab.wait_for_selector("#told >> text=3.000 s")
