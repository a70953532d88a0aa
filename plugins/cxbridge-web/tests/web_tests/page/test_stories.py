"""Questions of a user that the page answers; docs/see.md#the-page has their pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event
from cxbridge.trace.formats.mcap.writer import McapWriter
from tests.history import runs as made
from web_tests.page.test_moments import viewing

pytestmark = pytest.mark.smoke


def recorded(path: Path, events: Sequence[Event]) -> Path:
    with McapWriter(path) as writer:
        writer.event_types(RecordLevel.FACTS)
        for event in events:
            writer.write(event)
    return path


def delivery(*, fails: bool) -> list[Event]:
    """A goal with a plan-action whose skill succeeds, or fails."""
    end, outcome = ("FAILED", "FAILED") if fails else ("FINAL", "COMPLETED")
    return [
        made.goal(0, "deliver1", "FORMULATED"),
        made.goal(1, "deliver1", "DISPATCHED"),
        made.action(1, "deliver1", 1, "drive", "WAITING"),
        made.skill(1, 'drive{to="lab"}', "S_RUNNING"),
        made.action(2, "deliver1", 1, "drive", "RUNNING"),
        made.skill(5 - fails, 'drive{to="lab"}', f"S_{end}"),
        made.action(5, "deliver1", 1, "drive", end),
        made.fired(5, "deliver-ends"),
        made.goal(5, "deliver1", "FINISHED", outcome),
    ]


def test_what_changed_since_the_run_of_yesterday(tab, tmp_path):
    yesterday = recorded(tmp_path / "yesterday.mcap", delivery(fails=False))
    today = recorded(tmp_path / "today.mcap", delivery(fails=True))
    with viewing(yesterday, today) as (url, recordings):
        tab.goto(url + recordings.start)
        tab.wait_for_selector(".verdict >> text=They part at 5.000 s in A, 4.000 s in B")
        assert "S_FAILED" in tab.locator(".verdict").inner_text()
        assert tab.locator(".pair li.differs .pair-name").all_inner_texts() == ["deliver1 ≠"]
        tab.click("[aria-label='the next difference']")
        tab.wait_for_selector("h2 >> text=Difference 2 of")
        tab.click(".pair-bar.b")
        tab.wait_for_selector("#state >> text=RECORDING")
        assert "runs/1/today.mcap" in tab.url
