"""The page with an embedded recording, as a file and in a browser."""

from __future__ import annotations

import gzip
import json
import re
from base64 import b64decode
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

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
from cxbridge.trace.codec import encode_with_kind
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge.trace.formats.registry import open_run
from cxbridge_web.pages import STATIC_FOLDER
from cxbridge_web.report import report
from tests.support import share
from tests.trace.html.browser import RenderedPage, needs_browser, show
from tests.trace.runs import MemoryRun, family, goal
from web_tests.test_escaping import HOSTILE, Collector

START_US = 1_700_000_000_000_000


def hostile_events() -> list[Event]:
    events: list[Event] = []
    for text in HOSTILE:
        events += [
            GoalTransition(0, text, text, text, text, "nil", "FORMULATED", "UNKNOWN", text),
            GoalTransition(1, text, text, text, text, text, text, text, text),
            PlanActionTransition(2, text, text, text, text, text, text),
            RuleFired(3, text, 1, text, text),
            SkillStatus(4, text, text, text, 1, "S_RUNNING"),
            SkillStatus(5, text, text, text, 1, text),
            InterfaceWrite(6, f"{text}::{text}", {text.encode(errors="replace").decode(): text}),
            *(LogLine(7, level, text, text) for level in Level),
        ]
    return events


def modules_of(page: str) -> dict[str, str]:
    match = re.search(r'<script type="importmap">(.*?)</script>', page, re.DOTALL)
    assert match is not None
    urls = json.loads(match[1])["imports"]
    texts = {name: unquote(url.partition(",")[2]) for name, url in urls.items()}
    return {name: text.removesuffix(f"//# sourceURL={name}\n") for name, text in texts.items()}


def embedded_settings(page: str) -> dict[str, Any]:
    """Return the page's settings of the embedded recording."""
    site = json.loads(modules_of(page)["shared/site.js"].removeprefix("export default ").rstrip(";\n"))
    inside: dict[str, Any] = site["inside"]
    return inside


def embedded_recording(page: str) -> bytes:
    match = re.search(r'<script type="text/plain" id="recording">(.*?)</script>', page, re.DOTALL)
    assert match is not None
    return gzip.decompress(b64decode(match[1]))


def show_page(page: str, tmp_path: Path, fragment: str = "") -> RenderedPage:
    file = tmp_path / "run.html"
    file.write_text(page, encoding="utf-8")
    shown = show(file, tmp_path / "profile", fragment=fragment)
    assert shown.console == []
    return shown


def test_page_embeds_each_event():
    lines = embedded_recording(report(MemoryRun(family()))).splitlines()
    assert lines == [encode_with_kind(event) for event in family()]


def test_page_embeds_unchanged_mcap_file(tmp_path):
    path = tmp_path / "run.mcap"
    with McapWriter(path) as writer:
        for event in family():
            writer.write(event)
    page = report(open_run(path), "A <run>")
    assert embedded_recording(page) == path.read_bytes()
    assert embedded_settings(page)["name"] == "A <run>"
    assert "<title>A &lt;run&gt;</title>" in page


def test_page_embeds_each_module_and_style():
    page = report(MemoryRun(family()))
    folder = STATIC_FOLDER / "js"
    own = {f"cx/{path.relative_to(folder).as_posix()}": path.read_text() for path in folder.rglob("*.js")}
    assert {name: text for name, text in modules_of(page).items() if name.startswith("cx/")} == own
    for path in (folder.parent / "css").glob("*.css"):
        assert path.read_text() in page, path


@needs_browser
def test_browser_shows_goals_title_and_log(tmp_path):
    run = [*family(), LogLine(9_000_000, Level.WARN, "c", "a needle")]
    page = report(MemoryRun(run), "My run")
    shown = show_page(page, tmp_path)
    assert len(re.findall(r'role="treeitem"', shown.dom)) == 5
    assert "My run" in shown.dom
    assert "a needle" in show_page(page, tmp_path, "#/log").dom


def test_page_embeds_story_and_reasons_of_failures():
    pytest.importorskip("cxbridge_studio", reason="the studio explains runs")
    answers = embedded_settings(report(MemoryRun(family())))["answers"]
    assert [part["text"] for part in answers["run"]["wanted"]]
    assert set(answers) == {"run", "goal gen2", "goal RUN-gen3"}


@needs_browser
@pytest.mark.parametrize("view", share(["timeline", "goals", "skills", "log", "blackboard"], 1))
def test_hostile_strings_add_no_markup(tmp_path, view):
    shown = show_page(report(MemoryRun(hostile_events()), HOSTILE[0]), tmp_path, f"#/{view}")
    hostile = Collector()
    hostile.feed(shown.dom)
    plain = show_page(report(MemoryRun(family())), tmp_path, f"#/{view}")
    benign = Collector()
    benign.feed(plain.dom)
    assert hostile.tags.count("script") == benign.tags.count("script")
    assert hostile.tags.count("img") == benign.tags.count("img")
    assert [name for name, _ in hostile.attributes if name.startswith("on")] == []
    assert "\u202e" not in shown.dom


@needs_browser
def test_policy_stops_foreign_script(tmp_path):
    page = report(MemoryRun(family())).replace(
        "</body>", "<script>document.title = 'foreign'</script></body>"
    )
    file = tmp_path / "run.html"
    file.write_text(page, encoding="utf-8")
    shown = show(file, tmp_path / "profile")
    assert any("Content Security Policy" in line for line in shown.console)
    assert "foreign</title>" not in shown.dom


@needs_browser
@pytest.mark.parametrize(
    "run",
    share(
        [
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
def test_browser_shows_unusual_runs(tmp_path, run):
    assert 'aria-current="page"' in show_page(report(MemoryRun(run)), tmp_path).dom


@needs_browser
def test_page_reports_run_without_events(tmp_path):
    assert "has no events" in show_page(report(MemoryRun([])), tmp_path).dom
