"""A chosen moment holds in all views, live as well. Runs that are over say so. Recordings need no daemon."""

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


def modes(*names, goal="G", **more):
    """Transitions of a goal, a second apart."""
    return [
        goal_event(goal, name, time_us=START_US + second * S, **more)
        for second, name in enumerate(names, start=1)
    ]


def test_a_finished_run_says_what_became_of_it(tab, site, daemon):
    daemon.state, daemon.result = (
        "FINISHED",
        {"status": 1, "word": "unsuccessful", "reason": "G ended FAILED"},
    )
    tab.goto(f"{site.url}#/goals")
    tab.wait_for_selector("#state >> text=FINISHED: unsuccessful")
    assert tab.locator("#state").get_attribute("title") == "G ended FAILED"
    assert tab.locator("#pause").is_hidden()


@pytest.mark.smoke
def test_a_moment_of_the_live_run_is_the_moment_of_all_views(tab, site, daemon):
    daemon.answers["clips-executive/goals"] = [goal_model("G", "DISPATCHED"), goal_model("LATER", "SELECTED")]
    daemon.tell(
        *modes("FORMULATED", "SELECTED", "EXPANDED", "COMMITTED", "DISPATCHED"),
        {"kind": "log", "time_us": START_US + 6 * S, "level": "I", "component": "C", "text": "six"},
        goal_event("LATER", "SELECTED", time_us=START_US + 7 * S),
    )
    tab.goto(f"{site.url}#/goals")
    tab.wait_for_selector("[role=treeitem] >> text=LATER")
    tab.goto(f"{site.url}#/goals?time={START_US + 3 * S}")
    tab.wait_for_selector("#state >> text=PAST")
    tab.wait_for_selector("[role=treeitem]:has-text('G') >> text=EXPANDED")
    assert tab.locator("[role=treeitem] >> text=LATER").count() == 0
    tab.keyboard.press("2")  # Goals are not left: it is the same recording
    tab.keyboard.press(".")
    tab.wait_for_selector("[role=treeitem]:has-text('G') >> text=COMMITTED")
    tab.click("nav >> text=Log")
    tab.wait_for_selector("#state >> text=RUNNING")
    tab.wait_for_selector("#scrub >> text=At ")
    tab.click("nav >> text=CLIPS")
    tab.wait_for_selector("#told >> text=This view shows the present")
    tab.click("nav >> text=Goals")
    tab.wait_for_selector("#state >> text=PAST")
    tab.click("#to-live")
    tab.wait_for_selector("[role=treeitem] >> text=LATER")
    assert tab.locator("#scrub").is_hidden()
    assert "time=" not in tab.url


@contextmanager
def viewing(*paths):
    """What `cxbridge view` serves."""
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
    one, two = folder / "one.mcap", folder / "two.mcap"
    scenario = write_scenario(folder / "mini")
    command = [sys.executable, "-m", "cxbridge", "run", str(scenario), "-q", "--trace", str(one)]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    shutil.copy(one, two)
    return [one, two]


def test_recordings_are_viewed_without_a_daemon_and_without_asking_for_one(tab, runs):
    asked = []
    tab.on("request", lambda request: asked.append(request.url) if "/api/" in request.url else None)
    with viewing(*runs) as (url, recordings):
        tab.goto(url + recordings.start_path)
        tab.click("a >> text=one")
        tab.wait_for_selector("#state >> text=RECORDING")
        tab.wait_for_selector(".tl [role=treeitem] >> text=G")
        assert not tab.locator("#to-live").is_visible(), "there is nothing live to go back to"
        assert tab.locator("#pause").is_hidden()
        for view in ("Goals", "Skills", "Blackboard", "Plot", "World", "CLIPS", "Log"):
            tab.click(f"nav >> text={view}")
            tab.wait_for_selector("#main :is(h2, .panel):visible")
        tab.select_option("#run-choice", label="two.mcap")
        tab.wait_for_url("**/?run=/runs/1/two.mcap")
        tab.wait_for_selector(".tl [role=treeitem] >> text=G")
        tab.goto(f"{url}/?run=/runs/9/none")
        tab.wait_for_selector("#no-run >> text=two.mcap")
        tab.wait_for_selector("#state >> text=NO RUN")
        tab.wait_for_timeout(2500)  # a status is asked for every two seconds
    assert asked == []
