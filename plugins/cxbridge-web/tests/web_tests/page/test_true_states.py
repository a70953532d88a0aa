"""Links of skill calls, counts and times of recorded runs."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cxbridge.resources import shipped_dir
from cxbridge.run.options import RunOptions
from cxbridge.run.run import run_scenario
from web_tests.page.conftest import wait_for
from web_tests.page.fake import FakeDaemon, PageServer
from web_tests.page.test_moments import serve_recordings
from web_tests.page.test_timeline import retried


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The recording of a run of two robots on a skill board, with facts."""
    path = tmp_path_factory.mktemp("runs") / "two.mcap"
    scenario = shipped_dir("scenarios") / "two-robots"
    run_scenario(RunOptions(scenario=scenario, trace=path, trace_level="facts"))
    return path


@pytest.fixture
def opened(tab: Any, recorded: Path) -> Iterator[Any]:
    with serve_recordings(recorded) as (url, recordings):
        tab.goto(f"{url}{recordings.start_path}#/goals")
        tab.wait_for_selector("#state >> text=RECORDING")
        yield tab


def go_to(tab: Any, address: str) -> None:
    tab.evaluate("(address) => { location.hash = address; }", address)


def test_skill_call_is_linked_to_action_of_its_robot(opened: Any):
    for goal, robot in (("INSPECT-lab", "robot1"), ("INSPECT-store", "robot2")):
        go_to(opened, f"#/timeline/goal/{goal}/action/{goal}-PLAN%201")
        opened.wait_for_selector(f".tl-detail h2:has-text('Action 1 move {robot}')")
        calls = opened.locator(".tl-detail section:has(h3:text-is('Skill calls')) li a").all_inner_texts()
        assert calls == [f'{robot}: move{{to="{goal.removeprefix("INSPECT-")}"}}']


def test_table_and_detail_have_equal_times_of_goal(tab: Any, site: PageServer, daemon: FakeDaemon):
    daemon.files["run.jsonl"] = "\n".join(map(json.dumps, retried())).encode()
    tab.goto(f"{site.url}?run=files/run.jsonl#/goals")
    row = tab.locator("[role=treeitem]:has-text('G')")
    cells = [row.locator(f".c-{name}").inner_text() for name in ("began", "took", "done", "why")]
    assert cells == ["7.0 s", "8.0 s", "0/1", "action 1 move failed"]
    row.click()
    tab.wait_for_selector("#goal h2:text-is('G')")
    times = tab.locator("#goal dl.pairs dd").all_inner_texts()
    assert times[1:] == ["7.0 s", "7.000 s", "8.0 s", "15.000 s"]  # waited, began, ran, ended


def test_story_counts_each_skill_call_once(opened: Any):
    go_to(opened, "#/timeline")
    opened.wait_for_selector(".story-head >> text=Completed in 45.0 s")
    opened.wait_for_selector(".story-counts >> text=8 skill calls. No errors in the log")


def test_recording_of_skill_board_has_skills_of_executors(tab: Any, tmp_path: Path):
    """The recording has neither a Skiller nor a state graph."""
    trace = tmp_path / "workshop.mcap"
    run_scenario(RunOptions(scenario=shipped_dir("scenarios") / "workshop", trace=trace, timeout=60.0))
    with serve_recordings(trace) as (url, recordings):
        tab.goto(f"{url}{recordings.start_path}#/skills")
        wait_for(tab, lambda: "robot1-move" in tab.locator("#skiller option").all_inner_texts())
        tab.select_option("#skiller", label="robot1-move")
        wait_for(tab, lambda: tab.locator("[aria-label=Skills] [role=option]").count() == 2)
        assert "No skills" not in tab.inner_text("main")
        assert tab.locator("#calls li").count() > 0
