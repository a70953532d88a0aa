"""Coverage as a page."""

from __future__ import annotations

import re

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge_studio.explain.coverage.model import AgentSources, RecordedUse, coverage_of
from cxbridge_studio.explain.coverage.page import render, write_page
from cxbridge_studio.explain.rules.constructs import TextFile
from tests.history.runs import ENV, ListRun, action, fired, goal, skill

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


def page(run=RUN, *, firings_known=True):
    agent, use = AgentSources(), RecordedUse()
    agent.add_file(TextFile("/a/agent.clp", TEXT))
    agent.add_domain("(define (domain d) (:action wait :parameters ()))")
    agent.unwatched.add("ticks")
    agent.classes.add("SWIM")
    use.add(run, ENV)
    return render(coverage_of(agent, use), agent.texts, firings_known=firings_known)


def rows(text):
    """The cells of all rows of tables, without tags."""
    return [
        tuple(
            re.sub(r"<[^>]*>", "", cell).strip()
            for cell in re.findall(r"<td[^>]*>(.*?)</td>", row, re.DOTALL)
        )
        for row in re.findall(r"<tr[^>]*>(.*?)</tr>", text, re.DOTALL)
    ]


def test_files_and_what_never_fired():
    text = page()
    assert "1 of 2 rules fired in 1 run: 50.0 %" in text
    assert ("/a/agent.clp", "2", "1", "50.0", "two") in rows(text)
    assert '<a href="#f0-4">two</a>' in text
    assert '<tr id="f0-4" class="miss">' in text
    assert '<details id="f0" open>' in text


def test_lines_of_the_source_are_marked():
    text = page()
    found = rows(text)
    assert ("1", "", "; &lt;rules&gt;") in found
    assert ("2", "2\N{MULTIPLICATION SIGN}", "(defrule one (goal (class WALK)) =&gt;") in found
    assert ("3", "", "(printout t &quot;&lt;b&gt;&amp;&quot;))") in found
    assert ("4", "0\N{MULTIPLICATION SIGN}", "(defrule two =&gt;)") in found
    assert ("5", "not watched", "(defrule ticks =&gt;)") in found
    assert re.findall(r'class="(hit|miss|unknown)"', text) == ["hit", "hit", "miss", "unknown"]


def test_goals_actions_and_skills():
    found = rows(page())
    walk = next(row for row in found if row[:1] == ("WALK",))
    assert walk[1] == "1"
    assert "FORMULATED" in walk[2]
    assert walk[3] == "SELECTED, EXPANDED, COMMITTED, DISPATCHED, EVALUATED, RETRACTED"
    assert walk[4].endswith("FINISHED FAILED 1")
    assert ("SWIM", "0", "-", "all", "-") in found
    assert {("go", "1"), ("wait", "0"), ("say", "1")} <= set(found)


def test_without_firings_there_are_no_counts():
    text = page(ListRun([skill(4, "say{}", "S_RUNNING")]), firings_known=False)
    assert "was not recorded" in text
    assert "rules fired in" not in text
    assert "defrule" not in text
    assert 'id="source"' not in text


def test_nothing_is_fetched():
    text = page()
    assert "default-src 'none'" in text
    assert not re.search(r'(?:src|href)="(?!#|data:,)', text)
    assert "style=" not in text


def test_a_file_that_cannot_be_written(tmp_path):
    with pytest.raises(CxbridgeError, match="cannot be written"):
        write_page(
            tmp_path / "no" / "x.html", coverage_of(AgentSources(), RecordedUse()), {}, firings_known=True
        )
