"""What led to an event: the goals as a tree, the rules and events before it."""

from __future__ import annotations

import pytest

from cxbridge.events import RuleFired
from cxbridge.trace.compare.context import LINES_AFTER, LINES_BEFORE, RULES_BEFORE, ContextTracker
from tests.trace.runs import family, goal


def test_goals_are_a_tree_without_retracted_roots() -> None:
    tracker = ContextTracker()
    events = [
        *family(),
        goal("gen7", "RETRACTED"),
        goal("gen8", "FORMULATED", parent="gen7"),
        goal("gen9", "FORMULATED", parent="gen1"),
    ]
    for number, event in enumerate(events):
        tracker.add(event, number)
    assert [line.text for line in tracker.context(0).goals] == [
        "RUN-gen3 PARENT FINISHED FAILED (SUB-GOAL-FAILED gen2)",
        "  gen1 WORK FINISHED COMPLETED",
        "    gen9 WORK FORMULATED",
        "  gen2 WORK FINISHED FAILED (NO-PLAN)",
    ]


def test_goals_that_are_gone_are_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cxbridge.trace.compare.context.TIDY_AT", 10)
    tracker = ContextTracker()
    tracker.add(goal("stays", "SELECTED"), 0)
    for number in range(100):
        tracker.add(goal(f"gen{number}", "RETRACTED"), number + 1)
    assert [line.goal for line in tracker.context(0).goals] == ["stays"]
    assert len(tracker._goals) <= 11


def test_so_many_lines_before_and_after_and_so_many_rules() -> None:
    tracker = ContextTracker()
    for number in range(20):
        tracker.add(RuleFired(number * 1_000_000, "executive", number, f"rule-{number}", "*"), None)
        tracker.add(goal("gen1", f"MODE-{number}", time_us=number * 1_000_000), number)
    context = tracker.context(19)
    assert len(context.rules) == RULES_BEFORE
    assert context.rules[-1].split()[2] == "rule-19:"
    for number in range(20, 30):
        tracker.add(goal("gen1", f"MODE-{number}"), number)
    assert [line.number for line in context.lines] == list(range(20 - LINES_BEFORE, 21 + LINES_AFTER))
    assert [line.number for line in context.lines if line.here] == [20]
    assert context.lines[LINES_BEFORE].seconds == 19
