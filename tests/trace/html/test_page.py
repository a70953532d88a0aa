"""The frame of all pages: self-contained, strict, escaped."""

from __future__ import annotations

import re

import pytest

from cxbridge.history.outcome import OutcomeKind
from cxbridge.trace.html.page import Page, Section, asset
from cxbridge.trace.html.parts import (
    GoalNode,
    goal_badge,
    goal_tree,
    legend,
    notes,
    pairs,
    rules_list,
    table,
)
from cxbridge.trace.html.text import html
from tests.trace.html.browser import needs_browser, show
from tests.trace.html.test_text import HOSTILE


def family(text="gen1"):
    leaf = GoalNode(text, text, "FINISHED", "FAILED", error=text, note=text, marked=True)
    return [GoalNode("ROOT", "C", "DISPATCHED", children=[leaf, GoalNode("x", "y", "OWN-MODE")])]


def hostile_page():
    sections = [
        Section(
            f"s{number}",
            text,
            goal_tree(family(text), text)
            + table([text], [[html(text)]], caption=text)
            + pairs({text: text})
            + rules_list([text], text)
            + notes([text]),
        )
        for number, text in enumerate(HOSTILE)
    ]
    script = (
        'const out = cx.get("out"); for (const text of cx.data) out.append(cx.el("p", {title: text}, text));'
    )
    sections.append(Section("last", "Data", '<div id="out"></div>'))
    return Page("A page", sections=sections, data=HOSTILE, scripts=[script])


def test_a_page_asks_for_nothing():
    text = hostile_page().render()
    assert "default-src 'none'" in text
    assert "unsafe" not in text
    assert re.findall(r"\b(?:src|href)=\"(?!#|data:,)", re.sub(r"<script.*?</script>", "", text)) == []
    assert "url(" not in text
    assert "@import" not in text


@pytest.mark.parametrize("name", ["base.css", "base.js"])
def test_no_asset_ends_its_element(name):
    assert "</" not in asset(name)


def test_a_tree_tells_levels_and_states():
    text = goal_tree(family(), "goals")
    assert re.findall(r'aria-level="(\d)"', text) == ["1", "2", "2"]
    assert "✗</i>FINISHED FAILED" in text
    assert "○</i>OWN-MODE" in text  # a mode of the agent, before any end
    assert 'class="d1 marked"' in text


def test_a_tree_without_goals_says_so():
    assert "no goals" in goal_tree([], "goals")
    assert "no firings" in rules_list([], "rules")


def test_a_tree_may_be_deeper_than_anything_recursive():
    node = GoalNode("leaf", "C", "SELECTED")
    for number in range(5000):
        node = GoalNode(f"g{number}", "C", "SELECTED", children=[node])
    assert goal_tree([node], "deep").count("<li") == 5001


def test_outcomes_are_words_too():
    assert "COMPLETED" in goal_badge("RETRACTED", "COMPLETED")
    assert "UNKNOWN" not in goal_badge("SELECTED", "UNKNOWN")
    assert all(kind.word in legend() for kind in OutcomeKind)


@needs_browser
def test_a_browser_runs_the_page_and_nothing_in_it(tmp_path):
    page = tmp_path / "page.html"
    page.write_text(hostile_page().render(), encoding="utf-8")
    shown = show(page, tmp_path / "profile")
    assert shown.console == []
    assert "<title>A page</title>" in shown.dom
    assert shown.dom.count("<p title=") == len(HOSTILE)
    assert shown.dom.count("<script") == 2
    assert "<img" not in shown.dom


@needs_browser
def test_a_browser_refuses_what_is_not_ours(tmp_path):
    page = tmp_path / "page.html"
    text = Page("A page").render().replace("</main>", "<script>document.title='owned'</script></main>")
    page.write_text(text, encoding="utf-8")
    shown = show(page, tmp_path / "profile")
    assert "<title>A page</title>" in shown.dom
    assert any("Content Security Policy" in line for line in shown.console)
