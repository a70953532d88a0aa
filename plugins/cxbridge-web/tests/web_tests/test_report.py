"""The page with a recording inside, as a file and in a browser."""

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
            InterfaceWrite(6, f"{text}::{text}", {text.encode(errors="replace").decode(): text}),
            *(LogLine(7, level, text, text) for level in Level),
        ]
    return made


def modules_of(page: str) -> dict[str, str]:
    found = re.search(r'<script type="importmap">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    urls = json.loads(found[1])["imports"]
    texts = {name: unquote(url.partition(",")[2]) for name, url in urls.items()}
    return {name: text.removesuffix(f"//# sourceURL={name}\n") for name, text in texts.items()}


def inside_of(page: str) -> dict[str, Any]:
    """The page's data of the recording inside."""
    site = json.loads(modules_of(page)["shared/site.js"].removeprefix("export default ").rstrip(";\n"))
    inside: dict[str, Any] = site["inside"]
    return inside


def data_of(page: str) -> bytes:
    found = re.search(r'<script type="text/plain" id="recording">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    return gzip.decompress(b64decode(found[1]))


def look_at(page: str, tmp_path: Path, fragment: str = "") -> RenderedPage:
    file = tmp_path / "run.html"
    file.write_text(page, encoding="utf-8")
    shown = show(file, tmp_path / "profile", fragment=fragment)
    assert shown.console == []
    return shown


def test_every_event_is_inside():
    lines = data_of(report(MemoryRun(family()))).splitlines()
    assert lines == [encode_with_kind(event) for event in family()]


def test_an_mcap_file_is_inside_as_it_is(tmp_path):
    path = tmp_path / "run.mcap"
    with McapWriter(path) as writer:
        for event in family():
            writer.write(event)
    page = report(open_run(path), "A <run>")
    assert data_of(page) == path.read_bytes()
    assert inside_of(page)["name"] == "A <run>"
    assert "<title>A &lt;run&gt;</title>" in page


def test_every_module_and_style_of_the_page_is_inside():
    page = report(MemoryRun(family()))
    folder = STATIC_FOLDER / "js"
    own = {f"cx/{path.relative_to(folder).as_posix()}": path.read_text() for path in folder.rglob("*.js")}
    assert {name: text for name, text in modules_of(page).items() if name.startswith("cx/")} == own
    for path in (folder.parent / "css").glob("*.css"):
        assert path.read_text() in page, path


@needs_browser
def test_a_browser_shows_a_run(tmp_path):
    run = [*family(), LogLine(9_000_000, Level.WARN, "c", "a needle")]
    page = report(MemoryRun(run), "My run")
    shown = look_at(page, tmp_path)
    assert len(re.findall(r'role="treeitem"', shown.dom)) == 5
    assert "My run" in shown.dom
    assert "a needle" in look_at(page, tmp_path, "#/log").dom


def test_the_story_and_the_reasons_of_failures_are_inside():
    pytest.importorskip("cxbridge_studio", reason="the studio explains runs")
    answers = inside_of(report(MemoryRun(family())))["answers"]
    assert [part["text"] for part in answers["run"]["wanted"]]
    assert set(answers) == {"run", "goal gen2", "goal RUN-gen3"}


@needs_browser
@pytest.mark.parametrize("view", share(["timeline", "goals", "skills", "log", "blackboard"], 1))
def test_hostile_strings_stay_strings(tmp_path, view):
    shown = look_at(report(MemoryRun(hostile()), HOSTILE[0]), tmp_path, f"#/{view}")
    seen = Collector()
    seen.feed(shown.dom)
    plain = look_at(report(MemoryRun(family())), tmp_path, f"#/{view}")
    known = Collector()
    known.feed(plain.dom)
    assert seen.tags.count("script") == known.tags.count("script")
    assert seen.tags.count("img") == known.tags.count("img")
    assert [name for name, _ in seen.attributes if name.startswith("on")] == []
    assert "\u202e" not in shown.dom


@needs_browser
def test_the_policy_stops_other_scripts(tmp_path):
    page = report(MemoryRun(family())).replace(
        "</body>", "<script>document.title = 'stranger'</script></body>"
    )
    file = tmp_path / "run.html"
    file.write_text(page, encoding="utf-8")
    shown = show(file, tmp_path / "profile")
    assert any("Content Security Policy" in line for line in shown.console)
    assert "stranger</title>" not in shown.dom


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
def test_a_browser_shows_any_run(tmp_path, run):
    assert 'aria-current="page"' in look_at(report(MemoryRun(run)), tmp_path).dom


@needs_browser
def test_a_run_without_events_is_told(tmp_path):
    assert "has no events" in look_at(report(MemoryRun([])), tmp_path).dom
