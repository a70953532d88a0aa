"""Coverage as a page."""

from __future__ import annotations

import re

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge_studio.explain.coverage.model import AgentSources, RecordedUse, compute_coverage
from cxbridge_studio.explain.coverage.report import page_document, write_page
from cxbridge_studio.explain.rules.constructs import TextFile
from tests.history.runs import ENV, ListRun, action, fired, goal, skill
from tests.support import needs_plugin
from tests.trace.html.browser import needs_browser, show

TEXT = """; <rules>
(defrule one (goal (class WALK)) =>
  (printout t "<b>&"))
(defrule two =>)
(defrule ticks =>)
"""
RUN = ListRun(
    [
        fired(0, "one"),
        fired(1, "one"),
        goal(1, "walk1", "FORMULATED"),
        goal(2, "walk1", "FINISHED", "FAILED"),
        action(3, "walk1", 1, "go", "RUNNING"),
        skill(4, "say{}", "S_RUNNING"),
    ]
)


def document(run=RUN, *, firings_known=True):
    agent, use = AgentSources(), RecordedUse()
    agent.add_file(TextFile("/a/agent.clp", TEXT))
    agent.add_domain("(define (domain d) (:action wait :parameters ()))")
    agent.unwatched_rules.add("ticks")
    agent.goal_classes.add("SWIM")
    use.add(run, ENV)
    return compute_coverage(agent, use), agent.texts, firings_known


def made(*args, **kwargs):
    coverage, texts, firings_known = document(*args, **kwargs)
    return page_document(coverage, texts, firings_known=firings_known)


def test_files_have_their_rules_with_lines_and_source():
    (file,) = made()["rules"]["files"]
    assert (file["name"], file["total"], file["fired"]) == ("/a/agent.clp", 2, 1)
    assert [(rule["name"], rule["lines"], rule["firings"]) for rule in file["rules"]] == [
        ("one", (2, 3), 2),
        ("two", (4,), 0),
        ("ticks", (5,), None),
    ]
    assert file["text"] == TEXT


def test_without_firings_there_is_no_source():
    found = made(ListRun([skill(4, "say{}", "S_RUNNING")]), firings_known=False)
    assert not found["firings_known"]
    assert all(file["text"] == "" for file in found["rules"]["files"])


@needs_plugin("web")
@needs_browser
def test_a_browser_shows_it(tmp_path):
    page = tmp_path / "c.html"
    coverage, texts, known = document()
    write_page(page, coverage, texts, firings_known=known)
    shown = show(page, tmp_path / "profile")
    assert shown.console == []
    text = shown.dom
    assert "1 of 2 rules fired in 1 run: 50.0 %" in text
    assert re.findall(r'<tr class="(hit|miss|unknown)"', text) == ["hit", "hit", "miss", "unknown"]
    assert '<tr class="miss" id="f0-4">' in text
    assert '<details id="f0" open="">' in text
    assert "not watched" in text
    assert "(printout t &quot;&lt;b&gt;&amp;&quot;))" in text or '(printout t "&lt;b&gt;&amp;"))' in text
    walk = re.search(r"<td>WALK</td>(.*?)</tr>", text, re.DOTALL)
    assert walk is not None
    assert "SELECTED, EXPANDED, COMMITTED, DISPATCHED, EVALUATED, RETRACTED" in walk[1]
    for name, count in (("go", "1"), ("say", "1")):
        assert f'<td>{name}</td><td class="n">{count}</td>' in text
    assert '<td>wait</td><td class="n"><b class="never">0</b></td>' in text


@needs_plugin("web")
def test_a_file_that_cannot_be_written(tmp_path):
    (tmp_path / "no").touch()
    with pytest.raises(CxbridgeError, match="cannot be written"):
        write_page(
            tmp_path / "no" / "x.html",
            compute_coverage(AgentSources(), RecordedUse()),
            {},
            firings_known=True,
        )
