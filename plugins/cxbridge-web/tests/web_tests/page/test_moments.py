"""Selected moments in all views, finished runs, and recordings without a daemon."""

from __future__ import annotations

import shutil
import subprocess
import sys
from contextlib import contextmanager

import pytest

from cxbridge.clock import RealClock
from cxbridge.events import EventBus
from cxbridge_web.http.recordings import RecordingsApp
from cxbridge_web.http.serving import HttpThread
from cxbridge_web.settings import WebSettings
from tests.run.mini import write_scenario
from web_tests.page.fake import START_US, goal_event, goal_model

S = 1_000_000


def goal_events(*names, goal="G", **more):
    """Return transitions of a goal with a distance of a second."""
    return [
        goal_event(goal, name, time_us=START_US + second * S, **more)
        for second, name in enumerate(names, start=1)
    ]


def test_finished_run_shows_result(tab, site, daemon):
    daemon.state, daemon.result = (
        "FINISHED",
        {"status": 1, "word": "unsuccessful", "reason": "G ended FAILED"},
    )
    tab.goto(f"{site.url}#/goals")
    tab.wait_for_selector("#state >> text=FINISHED: unsuccessful")
    assert tab.locator("#state").get_attribute("title") == "G ended FAILED"
    assert tab.locator("#pause").is_hidden()


@pytest.mark.smoke
def test_selected_moment_of_live_run_holds_in_all_views(tab, site, daemon):
    daemon.answers["clips-executive/goals"] = [goal_model("G", "DISPATCHED"), goal_model("LATER", "SELECTED")]
    daemon.send_events(
        *goal_events("FORMULATED", "SELECTED", "EXPANDED", "COMMITTED", "DISPATCHED"),
        {"kind": "log", "time_us": START_US + 6 * S, "level": "I", "component": "C", "text": "six"},
        goal_event("LATER", "SELECTED", time_us=START_US + 7 * S),
    )
    tab.goto(f"{site.url}#/goals")
    tab.wait_for_selector("[role=treeitem] >> text=LATER")
    tab.goto(f"{site.url}#/goals?time={START_US + 3 * S}")
    tab.wait_for_selector("#state >> text=PAST")
    tab.wait_for_selector("[role=treeitem]:has-text('G') >> text=EXPANDED")
    assert tab.locator("[role=treeitem] >> text=LATER").count() == 0
    tab.keyboard.press("2")  # the view stays Goals with the same recording
    tab.keyboard.press(".")
    tab.wait_for_selector("[role=treeitem]:has-text('G') >> text=COMMITTED")
    tab.click("nav >> text=Log")
    tab.wait_for_selector("#state >> text=RUNNING")
    tab.wait_for_selector("#scrub >> text=At ")
    tab.click("nav >> text=CLIPS")
    tab.wait_for_selector("#moment-text >> text=This view shows the present")
    tab.click("nav >> text=Goals")
    tab.wait_for_selector("#state >> text=PAST")
    tab.click("#to-live")
    tab.wait_for_selector("[role=treeitem] >> text=LATER")
    assert tab.locator("#scrub").is_hidden()
    assert "time=" not in tab.url


@contextmanager
def serve_recordings(*paths):
    """Serve recordings as `cxbridge view` does."""
    recordings = RecordingsApp(paths)
    server = HttpThread(WebSettings(port=0), EventBus(RealClock()).logger("Web"))
    server.start(recordings)
    try:
        yield server.url, recordings
    finally:
        server.stop()


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Two recorded runs."""
    folder = tmp_path_factory.mktemp("runs")
    first, second = folder / "first.mcap", folder / "second.mcap"
    scenario = write_scenario(folder / "mini")
    command = [sys.executable, "-m", "cxbridge", "run", str(scenario), "-q", "--trace", str(first)]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    shutil.copy(first, second)
    return [first, second]


def test_recordings_are_shown_without_requests_to_daemon(tab, runs):
    api_requests = []
    tab.on("request", lambda request: api_requests.append(request.url) if "/api/" in request.url else None)
    with serve_recordings(*runs) as (url, recordings):
        tab.goto(url + recordings.start_path)
        tab.click("a >> text=first.mcap")
        tab.wait_for_selector("#state >> text=RECORDING")
        tab.wait_for_selector(".tl [role=treeitem] >> text=G")
        assert not tab.locator("#to-live").is_visible(), "a recording without a daemon has no live run"
        assert tab.locator("#pause").is_hidden()
        for view in ("Goals", "Skills", "Blackboard", "Plot", "World", "CLIPS", "Log"):
            tab.click(f"nav >> text={view}")
            tab.wait_for_selector("#main :is(h2, .panel):visible")
        tab.select_option("#run-choice", label="second.mcap")
        tab.wait_for_url("**/?run=/runs/1/second.mcap")
        tab.wait_for_selector(".tl [role=treeitem] >> text=G")
        tab.goto(f"{url}/?run=/runs/9/none")
        tab.wait_for_selector("#no-run >> text=second.mcap")
        tab.wait_for_selector("#state >> text=NO RUN")
        tab.wait_for_timeout(2500)  # the page requests the status each two seconds
    assert api_requests == []
