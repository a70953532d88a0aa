"""The page about a run, as a file and in a browser."""

from __future__ import annotations

import json
import re
from html import unescape
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cxbridge.events import (
    Event,
    GoalTransition,
    InterfaceWrite,
    Level,
    LogLine,
    PlanActionTransition,
    RuleFired,
    SkillStatus,
)
from cxbridge.trace.formats.base import Attachment
from cxbridge.trace.html.page import asset
from cxbridge_web.report import page as page_module
from cxbridge_web.report.model import ReportLimits
from cxbridge_web.report.page import SCRIPTS, report
from tests.support import needs_full, share
from tests.trace.events import events
from tests.trace.html.browser import Shown, needs_browser, show
from tests.trace.html.test_text import HOSTILE, Collector
from tests.trace.runs import MemoryRun, family, goal


class DescribedRun(MemoryRun):
    """A run with metadata and files."""

    def metadata(self):
        return {"spec": HOSTILE[0], "reason": HOSTILE[2]}

    def attachments(self):
        yield Attachment("a.clp", "text/plain", b"(defrule a =>)")
        yield Attachment("b.bin", "image/png", b"\xff\xfe")
        yield Attachment("c.yaml", "text/yaml", b"x" * 100_000)
        yield Attachment(HOSTILE[2], HOSTILE[0], HOSTILE[0].encode())


def hostile() -> list[Event]:
    made: list[Event] = []
    for text in HOSTILE:
        made += [
            GoalTransition(0, text, text, text, text, "nil", "FORMULATED", "UNKNOWN", text),
            GoalTransition(1, text, text, text, text, text, text, text, text),
            PlanActionTransition(2, text, text, text, text, text, text),
            RuleFired(3, text, 1, text, text),
            SkillStatus(4, text, text, text, 1, "S_RUNNING"),
            SkillStatus(5, text, text, text, 1, text),
            InterfaceWrite(6, f"{text}::{text}", {text: text}),
            *(LogLine(7, level, text, text) for level in Level),
        ]
    return made


def data_of(page: str) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    data: dict[str, Any] = json.loads(found[1])
    return data


def look_at(page: str, tmp_path: Path, fragment: str = "") -> Shown:
    file = tmp_path / "run.html"
    file.write_text(page, encoding="utf-8")
    shown = show(file, tmp_path / "profile", fragment=fragment)
    assert shown.console == []
    return shown


@pytest.mark.parametrize("name", [*SCRIPTS, "report.css"])
def test_no_asset_ends_its_element(name):
    assert "</" not in asset(name, "cxbridge_web.report")


def test_every_event_is_in_the_data():
    data = data_of(report(MemoryRun(family())))
    assert sum(len(each[5]) for each in data["goals"]) == 13
    assert sum(len(each[6]) for each in data["actions"]) == 3
    assert len(data["calls"]) == 1


def test_a_gap_in_the_log_is_a_row():
    lines = [LogLine(number, Level.INFO, "c", str(number)) for number in range(10)]
    data = data_of(report(MemoryRun(lines), limits=ReportLimits(log=4)))
    assert [row[4] if len(row) > 4 else row[2:] for row in data["log"]] == ["0", "1", [6, "I"], "8", "9"]


def test_files_that_are_too_large_or_no_text_are_named():
    page = report(DescribedRun(family()))
    assert "(defrule a =&gt;)" in page
    assert page.count("<td>not shown</td>") == 2
    assert "x" * 1000 not in page


@given(st.lists(events, max_size=12))
@settings(suppress_health_check=[HealthCheck.too_slow])
def test_any_events_make_a_page(several):
    data_of(report(MemoryRun(several)))


@needs_browser
def test_a_browser_shows_a_run(tmp_path):
    shown = look_at(report(MemoryRun(family()), "My run"), tmp_path)
    assert "<title>My run</title>" in shown.dom
    assert len(re.findall(r'role="treeitem"', shown.dom)) == 6
    assert re.findall(r'role="treeitem"[^>]*aria-level="(\d)"', shown.dom) == [
        *("1", "2"),  # the robots, one
        *("1", "2", "3", "2"),
    ]
    assert "the end" in shown.dom


@needs_full
@needs_browser
def test_a_browser_shows_a_moment(tmp_path):
    run = [
        goal("a", "FORMULATED"),
        goal("a", "SELECTED", time_us=2_000_000),
        goal("a", "EXPANDED", time_us=9_000_000),
    ]
    shown = look_at(report(MemoryRun(run)), tmp_path, "#t=3")
    assert "step 2 of 3: 2.000 s, goal a SELECTED" in shown.dom


DRIVER = """
(async () => {
  const { get, run, timeline } = cx, told = {};
  const rows = document.querySelector(".tl-names");
  const drawn = async () => { await new Promise((done) => setTimeout(done, 20)); timeline.draw(); };
  const press = (node, ...keys) => {
    for (const key of keys) node.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
  };
  const enter = (node, text) => { node.value = text; node.dispatchEvent(new Event("input")); };
  const count = () => rows.querySelectorAll("[role=treeitem]").length;
  await drawn(); press(rows, "Home"); await drawn();
  told.home = rows.querySelector("[aria-selected=true]").innerText.trim();
  press(rows, "End", "ArrowUp"); await drawn();
  for (let i = 0; i < 200 && !document.querySelector(".tl-detail h3"); i++) await drawn();
  told.chosen = timeline.path; told.detail = document.querySelector(".tl-detail h3").textContent;
  press(rows, "ArrowUp", "ArrowUp"); await drawn();
  press(rows, "ArrowLeft"); await drawn(); told.closed = count();
  press(rows, "ArrowRight"); await drawn(); told.opened = count();
  press(rows, ",", ","); await drawn(); told.moment = run.steps.length - run.moment;
  const shown = () => document.querySelector(".tl .count").textContent;
  const until = async (wanted) => { for (let i = 0; i < 200 && shown() !== wanted; i++) await drawn(); };
  enter(document.querySelector(".tl .find"), "gen2"); await until("2 of 3 goals"); told.found = shown();
  enter(document.querySelector(".tl .find"), ""); await until("3 goals");
  document.querySelector(".tl-legend .o-failed").click(); await until("2 of 3 goals"); told.failed = shown();
  enter(get("log-find"), "needle"); told.log = get("log-count").textContent;
  press(get("log-rows"), "ArrowDown", "Enter"); await drawn(); told.jumped = run.moment;
  document.body.append(cx.el("p", { id: "driven" }, JSON.stringify(told)));
})();
"""


@needs_browser
def test_keys_and_filters_of_the_page(tmp_path, monkeypatch):
    monkeypatch.setattr("cxbridge_web.report.page.SCRIPTS", (*SCRIPTS, "driver.js"))
    plain = page_module._asset
    monkeypatch.setattr(
        "cxbridge_web.report.page._asset", lambda name: DRIVER if name == "driver.js" else plain(name)
    )
    run = family()
    run.insert(5, LogLine(0, Level.INFO, "c", "a needle"))
    run.insert(9, LogLine(0, Level.INFO, "c", "hay"))
    shown = look_at(report(MemoryRun(run)), tmp_path)
    found = re.search(r'<p id="driven">(.*?)</p>', shown.dom)
    assert found is not None
    assert json.loads(unescape(found[1])) == {
        "home": "▾\nRobots",
        "chosen": {"goal": "gen1", "action": "gen1-PLAN 1"},
        "detail": "Action 1 say peggy ✓completed",
        "closed": 3,
        "opened": 6,
        "moment": 2,
        "found": "2 of 3 goals",
        "failed": "2 of 3 goals",
        "log": "1 of 2 lines",
        "jumped": 3,
    }


@needs_browser
def test_hostile_strings_stay_strings(tmp_path):
    shown = look_at(report(DescribedRun(hostile()), HOSTILE[0]), tmp_path)
    assert "<title>&lt;/script&gt;" in shown.dom
    seen = Collector()
    seen.feed(shown.dom)
    assert seen.tags.count("script") == 2
    assert "img" not in seen.tags
    assert [name for name, _ in seen.attributes if name.startswith("on")] == []
    assert "\u202e" not in shown.dom
    assert "\\u202e" in shown.dom


@needs_browser
@pytest.mark.parametrize(
    "run",
    share(
        [
            pytest.param([], id="empty"),
            pytest.param([LogLine(5, Level.INFO, "c", "only a line")], id="no goals"),
            pytest.param([InterfaceWrite(5, "T::i", {"x": 1})], id="a write"),
            pytest.param(family()[:-5], id="cut off"),
            pytest.param(
                [goal("a", "FORMULATED", time_us=99_000_000), goal("a", "FINISHED", time_us=3)],
                id="clock set back",
            ),
            pytest.param(
                [goal("a", "FORMULATED", parent="b"), goal("b", "FORMULATED", parent="a")], id="circle"
            ),
            pytest.param(
                [goal(f"g{n}", "FORMULATED", parent=f"g{n - 1}" if n else "nil") for n in range(3000)],
                id="deep",
            ),
        ],
        2,
    ),
)
def test_a_browser_shows_any_run(tmp_path, run):
    shown = look_at(report(MemoryRun(run)), tmp_path)
    assert 'id="told"' in shown.dom


def test_what_is_missing_is_told():
    assert "no events" in report(MemoryRun([]))
    assert "no goals" in report(MemoryRun([LogLine(5, Level.INFO, "c", "t")]))
    backwards = [goal("a", "FORMULATED", time_us=99_000_000), goal("a", "FINISHED", time_us=3)]
    assert "set back" in report(MemoryRun(backwards))


@needs_full
@needs_browser
def test_a_thousand_goals_and_a_hundred_thousand_events(tmp_path):
    run: list[Event] = []
    for number in range(1000):
        time = number * 1000
        run.append(
            goal(
                f"g{number}",
                "FORMULATED",
                parent=f"g{number - number % 10}" if number % 10 else "nil",
                time_us=time,
            )
        )
        run += [LogLine(time + k, Level.INFO, "c", f"line {k}") for k in range(98)]
        run.append(goal(f"g{number}", "FINISHED", "COMPLETED", time_us=time + 99))
    page = report(MemoryRun(run))
    assert len(data_of(page)["goals"]) == 1000
    shown = look_at(page, tmp_path)
    assert "98000 lines" in shown.dom or "of 98000" in shown.dom
    assert 0 < len(re.findall(r'role="treeitem"', shown.dom)) < 200
