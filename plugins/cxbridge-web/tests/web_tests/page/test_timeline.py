"""The timeline of live and recorded runs: drawing, zoom, filters and details."""

from __future__ import annotations

import json
from typing import Any

import pytest

from cxbridge_web.report import report
from tests.trace.runs import MemoryRun, goal
from web_tests.page.conftest import wait_for
from web_tests.page.fake import START_US, FakeDaemon, PageServer, goal_event

SECOND = 1_000_000
ACTION = {"kind": "plan-action", "env": "executive", "plan": "P", "action_id": "1", "action": "move"}
SKILL = {
    "kind": "skill",
    "env": "executive",
    "skiller": "robot1",
    "skill_string": 'move{to="lab"}',
    "msgid": 3,
}
LINE = {"kind": "log", "component": "Skiller"}


def at(seconds: float, *events: dict[str, Any]) -> list[dict[str, Any]]:
    return [event | {"time_us": START_US + round(seconds * SECOND)} for event in events]


def action(goal: str, state: str) -> dict[str, Any]:
    return ACTION | {"goal": goal, "state": state}


def failure() -> list[dict[str, Any]]:
    """Return a goal with a failed sub-goal, action and skill, and a rejected goal."""
    sent = {"skiller": SKILL["skiller"], "call": str(SKILL["msgid"])}
    failure_fields = {"parent": "ROOT", "error": "PATH-BLOCKED"}
    return [
        *at(0, goal_event("ROOT", "FORMULATED"), goal_event("FETCH", "FORMULATED", parent="ROOT")),
        *at(0, goal_event("IDLE", "FORMULATED"), SKILL | {"skill_string": "", "status": "S_INACTIVE"}),
        *at(1, goal_event("ROOT", "DISPATCHED"), goal_event("FETCH", "SELECTED", parent="ROOT")),
        *at(1, goal_event("IDLE", "FINISHED", "REJECTED")),
        *at(2, goal_event("FETCH", "DISPATCHED", parent="ROOT"), action("FETCH", "FORMULATED")),
        *at(2, action("FETCH", "PENDING"), action("FETCH", "WAITING"), SKILL | {"status": "S_RUNNING"}),
        *at(2.1, action("FETCH", "RUNNING") | sent, LINE | {"level": "I", "text": "driving"}),
        *at(6, LINE | {"level": "E", "text": "the way is blocked"}, SKILL | {"status": "S_FAILED"}),
        *at(6.1, action("FETCH", "EXECUTION-FAILED"), action("FETCH", "FAILED")),
        *at(
            7,
            goal_event("FETCH", "FINISHED", "FAILED", **failure_fields),
            goal_event("ROOT", "FINISHED", "FAILED"),
        ),
        *at(9, LINE | {"level": "I", "text": "waiting"}),
    ]


def retried() -> list[dict[str, Any]]:
    """Return a goal with two lives: the second action fails, then the first action."""
    second = {"action_id": "2", "action": "grasp"}
    modes = ("SELECTED", "DISPATCHED")
    return [
        *at(0, goal_event("G", "FORMULATED"), action("G", "FORMULATED"), action("G", "FORMULATED") | second),
        *at(7, *(goal_event("G", mode) for mode in modes), action("G", "FINAL")),
        *at(9, action("G", "FAILED") | second, goal_event("G", "FINISHED", "FAILED")),
        *at(10, *(goal_event("G", mode) for mode in modes), action("G", "FAILED")),
        *at(15, goal_event("G", "FINISHED", "FAILED")),
    ]


@pytest.fixture
def recorded(tab: Any, site: PageServer, daemon: FakeDaemon) -> Any:
    """The tab with the recorded failure."""
    daemon.files["run.jsonl"] = "\n".join(map(json.dumps, failure())).encode()
    tab.goto(f"{site.url}?run=files/run.jsonl")
    tab.wait_for_selector("#state >> text=RECORDING")
    tab.wait_for_selector(".tl [role=treeitem]")
    return tab


def labels(tab: Any) -> list[str]:
    return [text.strip() for text in tab.locator(".tl [role=treeitem] .hear-only").all_inner_texts()]


def window(tab: Any) -> tuple[float, float]:
    """Return begin and end of the shown window in seconds, which the canvas has only as pixels."""
    shown = tab.evaluate("document.querySelector('.tl').timeline.timeWindow")
    return (shown["from"] - START_US) / SECOND, (shown["to"] - START_US) / SECOND


def x_of(tab: Any, seconds: float) -> float:
    """Return the horizontal position of a time in pixels."""
    box = tab.locator(".tl-chart").bounding_box()
    begin, end = window(tab)
    return float(box["x"] + (seconds - begin) / (end - begin) * box["width"])


def y_of(tab: Any, name: str) -> float:
    box = tab.locator(f".tl [role=treeitem]:has-text('{name}')").first.bounding_box()
    return float(box["y"] + 10)


def colour(tab: Any, x: float, y: float) -> list[int]:
    """Return the most frequent colour of the pixels around a point of the chart."""
    rgb: list[int] = tab.evaluate(
        """([x, y]) => {
          const canvas = document.querySelector(".tl-chart"), box = canvas.getBoundingClientRect();
          const ratio = canvas.width / box.width, counts = new Map();
          const place = [(x - box.left) * ratio, (y - box.top) * ratio];
          const { data } = canvas.getContext("2d").getImageData(...place, 9, 7);
          for (let i = 0; i < data.length; i += 4) {
            const key = data.slice(i, i + 3).join();
            counts.set(key, (counts.get(key) || 0) + 1);
          }
          return [...counts].sort((a, b) => b[1] - a[1])[0][0].split(",").map(Number);
        }""",
        [x, y],
    )

    return rgb


def outcome_colour(tab: Any, outcome: str) -> list[int]:
    """Return the colour of an outcome in the style sheet."""
    text = tab.evaluate(
        """(outcome) => {
          const node = document.createElement("i");
          document.body.append(node);
          node.style.color = `var(--outcome-${outcome})`;
          const { color } = getComputedStyle(node);
          node.remove();
          return color;
        }""",
        outcome,
    )
    return [int(part) for part in text[text.index("(") + 1 : -1].split(",")[:3]]


@pytest.mark.smoke
def test_page_opens_timeline_and_shows_new_goals(tab, site, daemon):
    tab.goto(site.url)
    tab.wait_for_url("**/#/timeline")
    tab.wait_for_selector("text=No goals yet")
    daemon.send_events(goal_event("ROOT", "FORMULATED"), goal_event("LEAF", "DISPATCHED", parent="ROOT"))
    tab.wait_for_selector('.tl [role=treeitem][aria-level="2"]')
    assert labels(tab) == ["goal ROOT, waiting", "goal LEAF, running"]
    daemon.send_events(goal_event("LEAF", "FINISHED", "FAILED", parent="ROOT", error="NO-WAY"))
    tab.wait_for_selector(".tl-legend .o-failed >> text=1")
    wait_for(tab, lambda: "goal LEAF, failed, ran 0 ms, NO-WAY" in labels(tab))


def test_bars_have_colours_of_outcomes(recorded):
    tab = recorded
    assert colour(tab, x_of(tab, 4.5), y_of(tab, "FETCH")) == outcome_colour(tab, "failed")
    assert colour(tab, x_of(tab, 0.5), y_of(tab, "IDLE")) != outcome_colour(tab, "failed")


def test_bars_of_report_are_beside_names(tab):
    """The list gets the height of a row only when the page shows it, after it is filled."""
    names = [f"G{number}" for number in range(12)]
    begins = [goal(name, "DISPATCHED", time_us=0) for name in names]
    ends = [goal(name, "FINISHED", "FAILED", time_us=SECOND) for name in names]
    tab.set_content(report(MemoryRun([*begins, *ends]), "Many goals"))
    tab.wait_for_selector(".tl [role=treeitem]:has-text('G11')")
    box = tab.locator(".tl-chart").bounding_box()
    middle = box["x"] + box["width"] / 2
    wait_for(tab, lambda: colour(tab, middle, y_of(tab, "G0")) == outcome_colour(tab, "failed"))
    assert colour(tab, middle, y_of(tab, "G11")) == outcome_colour(tab, "failed")
    assert colour(tab, middle, y_of(tab, "G11") + 28) != outcome_colour(tab, "failed")


@pytest.mark.smoke
def test_story_links_to_its_parts_and_back(recorded):
    """The failed robot and the cause need no click; the skill call with its log needs a click."""
    tab = recorded
    tab.wait_for_selector(".story-head >> text=Failed after 7.0 s")
    tab.wait_for_selector('.story-head >> text=robot1 could not do move{to="lab"}')
    steps = tab.locator(".story .tl-why li a").all_inner_texts()
    ends = ["ROOT failed", "path blocked", "action 1 move failed", 'robot1 could not do move{to="lab"}']
    assert [step.lower().endswith(end.lower()) for step, end in zip(steps, ends, strict=True)] == [True] * 4
    tab.click(".story .tl-why a >> nth=3")
    tab.wait_for_selector(".tl-detail code >> text=move{to")
    tab.wait_for_selector(".tl-log >> text=the way is blocked")
    crumbs = tab.locator(".tl-crumbs li").all_inner_texts()
    assert crumbs == ["The run", "FETCH", "1 move", 'move{to="lab"}']
    tab.go_back()
    tab.wait_for_selector(".story")
    tab.mouse.click(x_of(tab, 4), y_of(tab, "FETCH"))
    tab.wait_for_selector(".tl-detail h2:has-text('Action 1 move')")
    tab.click(".tl-crumbs a:text-is('FETCH')")
    tab.wait_for_selector(".tl-detail h2:has-text('FETCH')")
    tab.wait_for_selector(".tl-detail .error-box >> text=path blocked")
    tab.click(".tl-detail [aria-label=close]")
    tab.wait_for_selector(".story")


def test_errors_are_marks_with_text(recorded):
    tab = recorded
    box = tab.locator(".tl-chart").bounding_box()
    tab.mouse.move(x_of(tab, 6), box["y"] + 34)
    tab.wait_for_selector(".tl-tip >> text=the way is blocked")
    tab.mouse.move(x_of(tab, 4.5), y_of(tab, "FETCH"))
    tab.wait_for_selector(".tl-tip >> text=failed, 4.0 s")
    tab.click("text=Next error")
    tab.wait_for_selector("#moment-text >> text=6.000 s")


def test_wheel_keys_and_buttons_zoom_and_pan(recorded):
    tab = recorded
    tab.mouse.move(x_of(tab, 6), y_of(tab, "FETCH"))
    full_window = window(tab)
    tab.mouse.wheel(0, -400)
    wait_for(tab, lambda: window(tab)[1] - window(tab)[0] < 0.6 * (full_window[1] - full_window[0]))
    assert window(tab)[0] < 6 < window(tab)[1]
    tab.get_by_role("tree").focus()
    before = window(tab)
    tab.keyboard.press("d")
    wait_for(tab, lambda: window(tab)[0] > before[0])
    tab.keyboard.press("0")
    wait_for(tab, lambda: window(tab) == full_window)
    tab.keyboard.press("+")
    wait_for(tab, lambda: window(tab)[1] - window(tab)[0] < full_window[1] - full_window[0])
    tab.click(".tl-zoom >> text=Fit")
    wait_for(tab, lambda: window(tab) == full_window)


def test_live_timeline_follows_until_panned(tab, site, daemon):
    tab.goto(site.url)
    daemon.send_events(*at(0, goal_event("A", "DISPATCHED")), *at(30, goal_event("B", "DISPATCHED")))
    wait_for(tab, lambda: len(labels(tab)) == 2)
    tab.wait_for_selector(".tl-now >> text=Following")
    tab.get_by_role("tree").focus()
    for _ in range(4):
        tab.keyboard.press("a")
    tab.wait_for_selector(".tl-now >> text=Back to now")
    window_before = window(tab)
    daemon.send_events(*at(90, goal_event("C", "DISPATCHED")))
    wait_for(tab, lambda: len(labels(tab)) == 3)
    assert window(tab) == window_before
    tab.click(".tl-now")
    wait_for(tab, lambda: window(tab)[1] >= 90)
    daemon.send_events(*at(200, goal_event("D", "DISPATCHED")))
    wait_for(tab, lambda: window(tab)[1] >= 200)


def test_goals_are_filtered_by_outcome_and_text(recorded):
    tab = recorded
    tab.click(".tl-legend .o-rejected")
    wait_for(
        tab,
        lambda: (
            [each for each in labels(tab) if each.startswith("goal")] == ["goal IDLE, rejected, ran 0 ms"]
        ),
    )
    tab.wait_for_selector(".tl .count >> text=1 of 3 goals")
    tab.click(".tl-legend .o-rejected")
    tab.fill(".tl .find", "blocked")
    # the matching goal and its parent
    tab.wait_for_selector(".tl .count >> text=2 of 3 goals")
    tab.fill(".tl .find", "nothing like it")
    tab.wait_for_selector(".tl .count >> text=0 of 3 goals")


def test_arrows_select_and_fold_without_history(recorded):
    tab = recorded
    length = tab.evaluate("history.length")
    tab.get_by_role("tree").focus()
    for key in ("Home", "ArrowDown", "ArrowDown", "ArrowDown"):
        tab.keyboard.press(key)
    tab.wait_for_selector(".tl-detail h2:has-text('FETCH')")
    assert not any("action" in each for each in labels(tab)), "the action is folded into the bar of its goal"
    tab.keyboard.press("ArrowRight")
    wait_for(tab, lambda: any("action" in each for each in labels(tab)))
    tab.keyboard.press("ArrowLeft")
    wait_for(tab, lambda: not any("action" in each for each in labels(tab)))
    assert tab.evaluate("history.length") == length
    tab.keyboard.press("Backspace")
    tab.wait_for_selector(".story")
