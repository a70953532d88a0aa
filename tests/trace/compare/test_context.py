"""The context of an event: the goals as a tree, and the preceding rules and events."""

from __future__ import annotations

from cxbridge.event_kinds import View
from cxbridge.events import Event, RuleFired
from cxbridge.trace.compare.context import LINES_AFTER, LINES_BEFORE, RULES_SHOWN, read_contexts
from tests.trace.runs import MemoryRun, family, goal


def test_goals_are_tree_without_retracted_roots() -> None:
    events = [
        *family(),
        goal("gen7", "RETRACTED"),
        goal("gen8", "FORMULATED", parent="gen7"),
        goal("gen9", "FORMULATED", parent="gen1"),
    ]
    context = read_contexts(MemoryRun(events), View.TRANSITIONS, [len(events) - 1])[len(events) - 1]
    assert [line.text for line in context.goals] == [
        "RUN-gen3 PARENT FINISHED FAILED (SUB-GOAL-FAILED gen2)",
        "  gen1 WORK FINISHED COMPLETED",
        "    gen9 WORK FORMULATED",
        "  gen2 WORK FINISHED FAILED (NO-PLAN)",
    ]


def test_context_has_fixed_numbers_of_lines_and_rules() -> None:
    events: list[Event] = []
    for number in range(30):
        time_us = number * 1_000_000
        events.append(RuleFired(time_us, "executive", number, f"rule-{number}", "*"))
        events.append(goal("gen1", f"MODE-{number}", time_us=time_us))
    context = read_contexts(MemoryRun(events), View.TRANSITIONS, [None, 19])[19]
    assert len(context.rules) == RULES_SHOWN
    assert context.rules[-1].split()[2] == "rule-19:"
    assert [line.number for line in context.lines] == list(range(20 - LINES_BEFORE, 21 + LINES_AFTER))
    assert [line.number for line in context.lines if line.here] == [20]
    assert context.lines[LINES_BEFORE].seconds == 19
