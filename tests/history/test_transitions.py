"""The tracker returns a transition when a state changes."""

from __future__ import annotations

import pytest

from cxbridge.history.transitions import MAX_RETIRED, TransitionTracker

GOAL = {
    "id": "gen1",
    "class": "WORK",
    "sub-type": "nil",
    "parent": "nil",
    "mode": "FORMULATED",
    "outcome": "UNKNOWN",
    "error": "",
    "message": '"so it is"',
}
ACTION = {"id": "10", "goal-id": "gen1", "plan-id": "gen1-PLAN", "action-name": "say", "state": "FORMULATED"}
SKILLER = {
    "id": '"Skiller"',
    "skill_string": '"say{text="a", wait=true}"',
    "msgid": "2",
    "status": "S_RUNNING",
}


@pytest.mark.parametrize("slot", ["mode", "outcome", "parent", "error"])
def test_change_of_state_is_goal_transition(slot: str) -> None:
    tracker = TransitionTracker("executive")
    assert tracker.track_assertion(1, "goal", GOAL) is not None
    assert tracker.track_assertion(2, "goal", GOAL) is None
    changed = tracker.track_goal(3, {**GOAL, slot: "OTHER"})
    assert changed is not None
    assert getattr(changed, slot) == "OTHER"
    assert (changed.time_us, changed.env, changed.goal) == (3, "executive", "gen1")
    assert tracker.track_goal(4, GOAL) is not None


@pytest.mark.parametrize("slot", ["message", "class", "sub-type"])
def test_change_of_other_slots_is_no_transition(slot: str) -> None:
    tracker = TransitionTracker("executive")
    tracker.track_goal(1, GOAL)
    assert tracker.track_goal(2, {**GOAL, slot: "OTHER"}) is None


def test_plan_action_is_identified_by_goal_plan_and_id() -> None:
    tracker = TransitionTracker("executive")
    assert tracker.track_assertion(1, "plan-action", ACTION) is not None
    assert tracker.track_assertion(1, "plan-action", ACTION) is None
    for slot in ("id", "goal-id", "plan-id", "state"):
        assert tracker.track_plan_action(2, {**ACTION, slot: "OTHER"}) is not None
    assert tracker.track_plan_action(3, {**ACTION, "action-name": "other", "state": "OTHER"}) is None


def test_every_skiller_fact_is_status() -> None:
    tracker = TransitionTracker("executive")
    for _ in range(2):
        event = tracker.track_assertion(5, "SkillerInterface", SKILLER)
        assert event is not None
        assert event == tracker.read_skiller_status(5, {**SKILLER, "id": "Skiller"})
    assert event.skill_string == 'say{text="a", wait=true}'  # type: ignore[union-attr]


def test_modified_fact_is_no_transition() -> None:
    tracker = TransitionTracker("executive")
    for template, slots in (("goal", GOAL), ("plan-action", ACTION)):
        assert tracker.track_assertion(1, template, slots) is not None
        tracker.record_retraction(template, slots)
        assert tracker.track_assertion(2, template, slots) is None


def test_memory_of_tracker_is_bounded() -> None:
    """A tracker that kept all goals and plan-actions leaked memory in a daemon."""
    tracker = TransitionTracker("executive")
    stays = {**GOAL, "id": "stays"}
    tracker.track_assertion(0, "goal", stays)
    sizes = set()
    for number in range(5 * MAX_RETIRED):
        goal = {**GOAL, "id": f"gen{number}"}
        action = {**ACTION, "goal-id": f"gen{number}"}
        assert tracker.track_assertion(number, "goal", goal) is not None
        assert tracker.track_assertion(number, "plan-action", action) is not None
        for template, slots in (("goal", goal), ("plan-action", action)):
            tracker.record_retraction(template, slots)
            assert tracker.track_assertion(number, template, slots) is None
            tracker.record_retraction(template, slots)
        sizes.add(len(tracker))
    assert max(sizes) <= 4 * MAX_RETIRED + 5
    assert tracker.track_assertion(0, "goal", stays) is None


@pytest.mark.parametrize(
    ("template", "slots"),
    [
        ("goal", {"id": "a"}),
        ("plan-action", {}),
        ("SkillerInterface", {**SKILLER, "msgid": "x"}),
        ("time", {}),
    ],
)
def test_facts_of_foreign_templates_are_ignored(template: str, slots: dict[str, str]) -> None:
    assert TransitionTracker("executive").track_assertion(0, template, slots) is None


def test_fact_without_slot_is_ignored() -> None:
    tracker = TransitionTracker("executive")
    assert (
        tracker.track_assertion(0, "goal", {key: value for key, value in GOAL.items() if key != "class"})
        is None
    )
    assert tracker.track_assertion(0, "goal", GOAL) is not None
