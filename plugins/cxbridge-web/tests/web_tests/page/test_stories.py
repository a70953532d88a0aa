"""The page's answers to questions of users; docs/see.md#the-page has pictures of the answers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event, InterfaceWrite
from cxbridge.run.options import RunOptions
from cxbridge.run.run import run_scenario
from cxbridge.trace.formats.mcap.writer import McapWriter
from tests.history import runs as made
from tests.run.mini import AGENT, write_scenario
from web_tests.page.conftest import wait_for
from web_tests.page.test_moments import serve_recordings

pytestmark = pytest.mark.smoke


def write_recording(path: Path, events: Sequence[Event]) -> Path:
    with McapWriter(path) as writer:
        writer.event_types(RecordLevel.FACTS)
        for event in events:
            writer.write(event)
    return path


def delivery(*, fails: bool) -> list[Event]:
    """Return a goal with an action whose skill succeeds or fails."""
    end, outcome = ("FAILED", "FAILED") if fails else ("FINAL", "COMPLETED")
    return [
        made.goal(0, "deliver1", "FORMULATED"),
        made.goal(1, "deliver1", "DISPATCHED"),
        made.action(1, "deliver1", 1, "drive", "WAITING"),
        made.skill(1, 'drive{to="lab"}', "S_RUNNING"),
        made.action(2, "deliver1", 1, "drive", "RUNNING"),
        made.skill(5 - fails, 'drive{to="lab"}', f"S_{end}"),
        made.action(5, "deliver1", 1, "drive", end),
        made.fired(5, "deliver-ends"),
        made.goal(5, "deliver1", "FINISHED", outcome),
    ]


def test_comparison_shows_first_difference_of_runs(tab, tmp_path):
    yesterday = write_recording(tmp_path / "yesterday.mcap", delivery(fails=False))
    today = write_recording(tmp_path / "today.mcap", delivery(fails=True))
    with serve_recordings(yesterday, today) as (url, recordings):
        tab.goto(url + recordings.start_path)
        tab.wait_for_selector(".verdict >> text=They part at 5.000 s in A, 4.000 s in B")
        assert "S_FAILED" in tab.locator(".verdict").inner_text()
        assert tab.locator(".pair li.differs .pair-name").all_inner_texts() == ["deliver1 ≠"]
        tab.click("[aria-label='the next difference']")
        tab.wait_for_selector("h2 >> text=Difference 2 of")
        tab.click(".pair-bar.b")
        tab.wait_for_selector("#state >> text=RECORDING")
        assert "runs/1/today.mcap" in tab.url


def test_why_shows_failing_condition_and_cause_of_fact(tab, tmp_path):
    never = AGENT + "\n(defrule mini-never (goal (id G) (mode RETRACTED)) (never) =>)"
    scenario, path = write_scenario(tmp_path / "mini", agent=never), tmp_path / "run.mcap"
    run_scenario(RunOptions(scenario=scenario, trace=path, trace_level="facts"))
    with serve_recordings(path) as (url, recordings):
        tab.goto(url + recordings.start_path + "#/clips/rules/mini-never")
        tab.click("#why-rule")
        tab.wait_for_selector("#why-text .failing >> text=RETRACTED")
        tab.goto(url + recordings.start_path + "#/clips/facts")
        tab.click("[role=option] >> text=(begun)")
        tab.click("#why-fact")
        tab.wait_for_selector("#why-text .cause >> text=rule mini-begin fired just before")


def test_stuck_run_shows_waiting_action(tab, tmp_path):
    """An action waits and no skill runs."""
    events = [*delivery(fails=False)[:3], made.action(1, "deliver1", 1, "drive", "PENDING")]
    late = InterfaceWrite(made.us(9), "BatteryInterface::B", {"voltage": 12.5})
    with serve_recordings(write_recording(tmp_path / "run.mcap", [*events[:2], events[3], late])) as (
        url,
        recordings,
    ):
        tab.goto(url + recordings.start_path)
        tab.wait_for_selector(".story-head p >> text=action 1 drive of deliver1 has been PENDING")
        assert tab.locator(".story-head a").first.get_attribute("href") == "#/timeline/goal/deliver1"
        tab.wait_for_selector(".story .outcome >> text=waiting")
        tab.wait_for_selector("#moment-text >> text=9.000 s, nothing new since 1.000 s: action drive")
        tab.wait_for_selector(".story-why >> text=action 1 drive of deliver1 has been PENDING since 1.000 s")
        tab.goto(url + recordings.start_path + "#/timeline/goal/deliver1")
        tab.click("#why")
        tab.wait_for_selector("#why-text >> text=waits for its actions and sub-goals")
        tab.wait_for_selector(".detail-head .o-formulated >> text=DISPATCHED, waits")
        tab.click(".action a >> text=1 drive")
        tab.wait_for_selector("dd >> text=never started")
        tab.wait_for_selector("text=The action never started.")


def test_story_counts_failures_of_skill(tab, tmp_path):
    events = []
    for at, name in ((0, "look1"), (10, "look2")):
        events += [
            made.goal(at, name, "DISPATCHED"),
            made.action(at, name, 1, "look", "WAITING"),
            made.skill(at + 1, 'look{at="lab"}', "S_RUNNING"),
            made.action(at + 1, name, 1, "look", "RUNNING"),
            made.skill(at + 2, 'look{at="lab"}', "S_FAILED"),
            made.action(at + 2, name, 1, "look", "FAILED"),
            made.goal(at + 2, name, "FINISHED", "FAILED"),
        ]
    with serve_recordings(write_recording(tmp_path / "run.mcap", events)) as (url, recordings):
        tab.goto(url + recordings.start_path)
        tab.wait_for_selector(".story-why >> text=it failed 2 of 2 times (Skiller, Skiller)")


def test_world_shows_place_of_robot_at_failure(tab, tmp_path):
    """The place needs two clicks: the view, and the red bar."""
    pose = {"frame": "map", "translation": [0.0, 0.0, 0.0], "rotation": [0, 0, 0, 1], "visibility_history": 1}
    places = [
        InterfaceWrite(
            made.us(at), "Position3DInterface::Pose", pose | {"translation": [float(at), 2.0, 0.0]}
        )
        for at in range(1, 7)
    ]
    events = sorted([*delivery(fails=True), *places], key=lambda event: event.time_us)
    with serve_recordings(write_recording(tmp_path / "run.mcap", events)) as (url, recordings):
        tab.goto(url + recordings.start_path)
        tab.click("nav >> text=World")
        tab.wait_for_selector(".lane-bar.o-failed")
        box = tab.locator(".lane-bar.o-failed").bounding_box()
        tab.mouse.click(box["x"] + box["width"], box["y"] + 3)
        robot = tab.locator("[data-robot=Skiller]")
        wait_for(tab, lambda: "FAILED" in robot.inner_text() and "at 4.00, 2.00 m" in robot.inner_text())
        assert 'drive{to="lab"}' in robot.inner_text()


def test_plot_proposes_the_values_that_changed(tab, tmp_path):
    events = [
        *delivery(fails=False),
        *(
            InterfaceWrite(made.us(at), "BatteryInterface::B", {"voltage": 12.5 - at / 10})
            for at in range(6, 12)
        ),
    ]
    with serve_recordings(write_recording(tmp_path / "run.mcap", events)) as (url, recordings):
        tab.goto(url + recordings.start_path + "#/plot")
        tab.click("[aria-label='plot BatteryInterface::B.voltage']")
        tab.wait_for_selector("#plot-legend [data-series='BatteryInterface::B.voltage']")
        assert "BatteryInterface" in tab.url
