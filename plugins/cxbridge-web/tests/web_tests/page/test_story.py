"""The first screen of the page: state, running skills, failure, stop and link."""

from __future__ import annotations

import json
from typing import Any

import pytest

from cxbridge_web.report import report
from tests.trace.runs import MemoryRun, goal
from web_tests.page.conftest import PHONE, wait_for
from web_tests.page.fake import START_US, FakeDaemon, PageServer, goal_event
from web_tests.page.test_timeline import SECOND, SKILL, at, failure

ONE_HAND = 0.45
"""The lower part of a telephone's height that the thumb of a single hand reaches."""


@pytest.mark.smoke
def test_story_shows_running_and_late_skill(tab: Any, site: PageServer, daemon: FakeDaemon):
    move = SKILL | {"skill_string": 'move{to="hall"}', "msgid": 1}
    daemon.send_events(
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
    wait_for(
        tab, lambda: tab.evaluate(late) == ['move{to="lab"}']
    )  # the page updates late skills twice a second


@pytest.mark.smoke
def test_telephone_shows_story_and_pauses_with_one_hand(tab: Any, site: PageServer, daemon: FakeDaemon):
    """State, running skills, failure and cause need no touch; a pause needs a touch near the thumb."""
    tab.set_viewport_size(PHONE)
    daemon.send_events(*failure(), *at(9, SKILL | {"status": "S_RUNNING", "msgid": 4}))
    tab.goto(site.url)
    tab.wait_for_selector("#state >> text=RUNNING")
    tab.wait_for_selector('.story-head >> text=robot1 could not do move{to="lab"}')
    tab.wait_for_selector(".story section:has(h3:text-is('Now')) >> text=robot1")
    for selector in ("#pause", "#nav a[data-view=goals]"):
        box = tab.locator(selector).bounding_box()
        assert box["y"] > PHONE["height"] * (1 - ONE_HAND), selector
        assert box["height"] >= 40, selector
    tab.click("#pause")
    tab.wait_for_selector("#state >> text=PAUSED")
    assert daemon.count("POST", "cxbridge/pause") == 1
    assert tab.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]


def test_copied_address_opens_same_moment_and_filter(browser: Any, site: PageServer, daemon: FakeDaemon):
    daemon.files["run.jsonl"] = "\n".join(map(json.dumps, failure())).encode()
    context = browser.new_context(permissions=["clipboard-read", "clipboard-write"])
    sender = context.new_page()
    sender.goto(f"{site.url}?run=files/run.jsonl#/goals?outcome=failed")
    sender.click("[role=treeitem] >> text=FETCH")
    sender.keyboard.press(",")
    sender.keyboard.press("l")
    sender.wait_for_selector("text=is copied")
    address = sender.evaluate("navigator.clipboard.readText()")
    moment = sender.inner_text("#moment-text")
    receiver = context.new_page()
    receiver.goto(address)
    receiver.wait_for_selector("#goal h2:text-is('FETCH')")
    receiver.wait_for_selector(f"#moment-text >> text={moment.split('·')[1].split(',')[0].strip()}")
    assert receiver.get_by_label("outcome", exact=True).input_value() == "failed"
    context.close()


@pytest.mark.smoke
def test_report_opens_at_failure(tab: Any, site: PageServer, daemon: FakeDaemon):
    run = [
        goal("TOUR", "DISPATCHED", time_us=START_US),
        goal("TOUR", "FINISHED", "FAILED", time_us=START_US + 3 * SECOND),
        goal("OTHER", "FINISHED", "COMPLETED", time_us=START_US + 9 * SECOND),
    ]
    daemon.files["run.html"] = report(MemoryRun(run), "A run").encode()
    tab.goto(f"{site.url}files/run.html")
    tab.wait_for_selector(".story-head >> text=Failed after 9.0 s")
    tab.wait_for_selector("#moment-text >> text=3.000 s")
