"""``trace diff`` with its outputs: text, JSON, JUnit, a page; patterns."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from cxbridge.cli.main import invoke
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event, GoalTransition, PlanActionTransition, RuleFired, SkillStatus
from cxbridge.trace.formats.mcap.writer import McapWriter
from tests.support import needs_plugin
from tests.trace.html.browser import needs_browser, show
from tests.trace.runs import family, skill


def record(path: Path, events: Sequence[Event]) -> Path:
    with McapWriter(path) as writer:
        types = writer.event_types(RecordLevel.FACTS)
        for event in events:
            assert type(event) in types
            writer.write(event)
    return path


def with_rules(events: Sequence[Event]) -> list[Event]:
    kinds = {GoalTransition: "goal", PlanActionTransition: "action", SkillStatus: "skill"}
    found: list[Event] = []
    for number, event in enumerate(events, 1):
        found += [RuleFired(0, "executive", number, f"{kinds[type(event)]}-<rule>", "f-1"), event]
    return found


@pytest.fixture
def runs(tmp_path: Path) -> tuple[str, str]:
    events = family()
    other = [*events[:12], skill("</script><b>{}", "S_RUNNING"), *events[13:]]
    del other[9]
    return (
        str(record(tmp_path / "a.mcap", with_rules(events))),
        str(record(tmp_path / "b & c.mcap", with_rules(other))),
    )


def diff(*arguments: object) -> int:
    return invoke(["trace", "diff", *map(str, arguments)])


def test_report_shows_both_runs(runs: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert diff(*runs) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "differ in 2 places, total order: A has 18 transitions, B 17"
    assert lines[4] == "first difference: plan gen1-PLAN of goal gen1: an event that only A has"
    assert lines[6] == "  B [9] (nothing here)"
    assert [line[0] for line in lines[lines.index("what led to it in A:") + 1 :][:9]] == [*"      >  "]
    assert "  rules that fired just before in B:" in lines
    assert "further differences:" in lines


def test_json_is_complete(runs: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert diff(*runs, "--json", "--ignore", "goal:gen7", "--time-tolerance", "5") == 1
    captured = capsys.readouterr()
    report = json.loads(captured.out)
    assert report["options"]["ignore"] == ["goal:gen7"]
    assert report["options"]["time_tolerance"] == 5
    assert report["b"] == {"path": runs[1], "format": "mcap", "events": 17, "number": 1}
    assert [difference["kind"] for difference in report["differences"]] == ["only-a", "changed"]
    assert report["differences"][0] == {
        "kind": "only-a",
        "subject": "plan gen1-PLAN of goal gen1",
        "what": "an event that only A has",
        "count": 1,
        "a": {"event": 10, "text": "plan-action 1 goal=gen1 plan=gen1-PLAN action=say state=FORMULATED"},
        "b": {"event": 9, "text": "(nothing here)"},
    }
    assert report["first"]["a"]["goals"][0]["goal"] == "RUN-gen3"
    assert [rule.split()[2] for rule in report["first"]["b"]["rules"]][-1] == "goal-<rule>:"
    assert "pattern 'goal:gen7' matches no event" in captured.err


def test_equal_runs_as_json(runs: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert diff(runs[0], runs[0], "--json", "--order", "partial") == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["same"], report["total"], report["first"], report["differences"]) == (True, 0, None, [])


def test_junit_file_lists_differences(
    runs: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "junit.xml"
    assert diff(*runs, "--junit", path) == 1
    suites = ET.parse(path).getroot()
    assert (suites.get("tests"), suites.get("failures")) == ("1", "1")
    case = suites[0][0]
    assert case.get("classname") == "trace.diff.transitions.total"
    assert case.get("name") == f"{runs[0]} is the same as {runs[1]}"
    assert case[0].get("message") == "plan gen1-PLAN of goal gen1: an event that only A has"
    assert "what led to it" in (case[0].text or "")
    assert diff(runs[0], runs[0], "--junit", path) == 0
    assert ET.parse(path).getroot().get("failures") == "0"
    assert diff(*runs, "--junit", tmp_path / "absent" / "junit.xml") == 1
    assert diff(*runs, "--junit", path / "junit.xml") == 2
    assert "cannot be written: Not a directory" in capsys.readouterr().err


def test_characters_invalid_in_xml_are_replaced(tmp_path: Path) -> None:
    a = record(tmp_path / "a.mcap", [skill("x\x00\x1b", "S_RUNNING")])
    b = record(tmp_path / "b.mcap", [skill("y\ufffe", "S_RUNNING")])
    assert diff(a, b, "--junit", tmp_path / "junit.xml") == 1
    text = ET.parse(tmp_path / "junit.xml").getroot()[0][0][0].text or ""
    assert "x\\u0000\\u001b" in text
    assert "y\ufffd" in text


@needs_plugin("web")
@pytest.mark.parametrize("order", ["total", "partial"])
def test_page_embeds_json(
    runs: tuple[str, str], tmp_path: Path, order: str, capsys: pytest.CaptureFixture[str]
) -> None:
    from web_tests.test_report import embedded_recording, embedded_settings

    path = tmp_path / "diff.html"
    assert diff(*runs, "--html", path, "--order", order, "--json") == 1
    page = path.read_text()
    document, plain = json.loads(embedded_recording(page)), json.loads(capsys.readouterr().out)
    assert {name: document[name] for name in plain} == plain
    assert document["contexts"][0] == {side: plain["first"][side] for side in "ab"}
    assert len(document["contexts"]) == len(plain["differences"])
    rows = [(row["label"], row["depth"], row["a"] is None, row["b"] is None) for row in document["goals"]]
    assert rows[0][1] == 0
    assert {end["goal"] for row in document["goals"] for end in (row["a"], row["b"]) if end} >= {"gen1"}
    assert embedded_settings(page) == {"kind": "comparison", "name": "a.mcap and b & c.mcap"}


@needs_plugin("web")
@needs_browser
@pytest.mark.parametrize("order", ["total", "partial"])
def test_browser_renders_page_without_errors(runs: tuple[str, str], tmp_path: Path, order: str) -> None:
    path = tmp_path / "diff.html"
    assert diff(*runs, "--html", path, "--order", order) == 1
    shown = show(path, tmp_path / "profile")
    assert shown.console == []
    for part in ("Where they part", "What led to it", "Rules that fired", "All diff"):
        assert f"{part}" in shown.dom
    assert 'class="aligned"' in shown.dom
    assert "&lt;/script&gt;&lt;b&gt;{}" in shown.dom


@needs_plugin("web")
@needs_browser
def test_page_of_equal_runs(runs: tuple[str, str], tmp_path: Path) -> None:
    path = tmp_path / "diff.html"
    assert diff(runs[0], runs[0], "--html", path) == 0
    assert "same: 18 transitions, total order" in show(path, tmp_path / "profile").dom
