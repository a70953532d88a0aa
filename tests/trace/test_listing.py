"""Events as lines of text."""

from __future__ import annotations

import pytest

from cxbridge.events import Event, InterfaceMessage, PlannerCall
from cxbridge.trace.listing import event_filter, text_lines
from tests.trace.runs import MemoryRun

UID = "SkillerInterface::Skiller"


def call(status: str, *, call_id: str = "plan-1", **named: object) -> PlannerCall:
    values = {"duration_us": 0, "actions": 0, "reason": "", **named}
    return PlannerCall(0, "executive", call_id, "gen1", "auto", "d", "(at a b)", status, **values)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("event", "text"),
    [
        (
            InterfaceMessage(0, UID, "ExecSkillMessage", 3, "CLIPS", "queued", {"a": "b"}),
            'message     SkillerInterface::Skiller <- ExecSkillMessage 3 from CLIPS, queued: {"a":"b"}',
        ),
        (
            InterfaceMessage(0, UID, "StopExecMessage", 4, "", "sent", {}),
            "message     SkillerInterface::Skiller <- StopExecMessage 4, sent: {}",
        ),
        (call("started"), "planner     plan-1 for gen1: started by auto: (at a b) in domain d"),
        (
            call("found", duration_us=1_500_000, actions=3),
            "planner     plan-1 for gen1: found by auto after 1.500 s: 3 actions",
        ),
        (
            call("failed", call_id="", reason="no domain"),
            "planner     for gen1: failed by auto after 0.000 s: no domain",
        ),
    ],
)
def test_messages_and_planner_calls_have_texts(event: Event, text: str) -> None:
    (line,) = text_lines(MemoryRun([event]), event_filter([], ""))
    assert line == f"    0.000000 {text}"
