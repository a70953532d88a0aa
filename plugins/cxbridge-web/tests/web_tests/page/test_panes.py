"""Panes of goals and skills, filters, and the search."""

from __future__ import annotations

from functools import partial

import pytest

from web_tests.page.conftest import show_past_goals, wait_for
from web_tests.page.fake import START_US, fact_model, goal_event, goal_model

SECOND = 1_000_000
RULE = (
    '(defrule open-door "Opens."\n  ; as soon as it may\n  (door (open FALSE))\n  =>\n  (assert (go ?x 1)))'
)


def _equal(actual, expected):
    return sorted(actual()) == sorted(expected)


def action_event(goal, number, state, **fields):
    plain = {"env": "executive", "plan": "P", "action": "move", "time_us": START_US}
    return {"kind": "plan-action", "goal": goal, "action_id": number, "state": state} | plain | fields


def skill_event(text, status, skiller="robot1", **fields):
    plain = {"env": "executive", "msgid": 1, "time_us": START_US}
    return {"kind": "skill", "skiller": skiller, "skill_string": text, "status": status} | plain | fields


@pytest.fixture
def failed_run(daemon):
    """A root goal whose sub-goal fails because of a failed skill."""
    daemon.answers["clips-executive/goals"] = []
    daemon.send_events(
        goal_event("ROOT", "DISPATCHED", goal_class="ROUND"),
        goal_event("LEAF", "DISPATCHED", parent="ROOT", goal_class="INSPECT"),
        goal_event("GOOD", "DISPATCHED", parent="ROOT", goal_class="INSPECT"),
        action_event("LEAF", "1", "FORMULATED"),
        action_event("LEAF", "1", "PENDING"),
        skill_event('move{to="lab"}', "S_RUNNING"),
        action_event("LEAF", "1", "RUNNING", time_us=START_US + SECOND, skiller="robot1", call="1"),
        skill_event('move{to="lab"}', "S_FAILED", time_us=START_US + 2 * SECOND),
        action_event("LEAF", "1", "FAILED", time_us=START_US + 2 * SECOND),
        goal_event("GOOD", "RETRACTED", "COMPLETED", parent="ROOT", goal_class="INSPECT"),
        *(
            goal_event(name, mode, "FAILED", parent=parent, error=error, time_us=START_US + 3 * SECOND)
            for name, parent, error in (("LEAF", "ROOT", "STUCK"), ("ROOT", "nil", ""))
            for mode in ("FINISHED", "RETRACTED")
        ),
    )


def test_table_of_goals_shows_cause_and_duration(tab, site, failed_run):
    tab.goto(f"{site.url}#/goals")
    row = tab.locator("[role=treeitem]:has-text('LEAF')")
    wait_for(tab, lambda: 'robot1 could not do move{to="lab"}' in row.inner_text())
    assert "3.0 s" in row.inner_text()
    tab.wait_for_selector("[role=treeitem]:has-text('ROOT') >> text=2/2")
    tab.click("[role=treeitem] >> text=LEAF")
    tab.wait_for_selector("#goal .error-box >> text=STUCK")
    tab.click("#goal .action >> text=1 move")
    tab.wait_for_selector(".tl-detail h2:has-text('Action 1 move')")


def test_goals_are_filtered_by_outcome_class_and_robot(tab, site, daemon, failed_run):
    daemon.send_events(
        goal_event("OTHER", "DISPATCHED", goal_class="INSPECT"),
        action_event("OTHER", "1", "PENDING"),
        skill_event('move{to="x"}', "S_RUNNING", skiller="robot2"),
        action_event("OTHER", "1", "RUNNING", skiller="robot2", call="1"),
    )
    tab.goto(f"{site.url}#/goals")
    tab.wait_for_selector("[role=treeitem]")
    show_past_goals(tab)
    rows = tab.get_by_role("treeitem")
    wait_for(tab, lambda: rows.count() == 4)

    def shown_goals():
        names = ("ROOT", "LEAF", "GOOD", "OTHER")
        return [name for text in rows.all_inner_texts() for name in names if name in text]

    for name, value, expected in (
        ("outcome", "failed", ["ROOT", "LEAF"]),
        ("outcome", "", ["ROOT", "LEAF", "GOOD", "OTHER"]),
        ("robot", "robot2", ["OTHER"]),
        ("robot", "robot1", ["LEAF"]),
        ("robot", "", ["ROOT", "LEAF", "GOOD", "OTHER"]),
        ("class", "CLASS", ["ROOT", "LEAF"]),
    ):
        tab.get_by_label(name, exact=True).select_option(value)
        wait_for(tab, partial(_equal, shown_goals, expected))
    tab.get_by_label("outcome", exact=True).select_option("failed")
    assert tab.url.endswith("#/goals?class=CLASS&outcome=failed")


@pytest.mark.smoke
def test_skills_of_skill_board_have_executors_and_fill_call(tab, site, daemon):
    daemon.answers |= {
        "blackboard/interfaces": [
            {"type": "SkillerInterface", "id": "robot1", "writer": "b", "readers": []},
            {"type": "SkillExecutorInterface", "id": "robot1-legs", "writer": "e", "readers": []},
        ],
        "blackboard/interfaces/SkillerInterface/robot1/data": {
            "data": {"skill_string": "", "status": "S_INACTIVE", "error": "", "exclusive_controller": ""}
        },
        "cxbridge/interfaces": [
            {"id": "robot1-legs", "data": {"agent": "robot1", "skills": "move jump", "state": "IDLE"}}
        ],
    }
    tab.goto(f"{site.url}#/skills")
    tab.wait_for_selector("[role=option]:has-text('jump') >> text=robot1-legs")
    daemon.send_events(*(skill_event('move{to="lab"}', status) for status in ("S_RUNNING", "S_FAILED")))
    tab.wait_for_selector("[role=option]:has-text('move') >> text=FAILED")
    tab.click("[role=option] >> text=move")
    wait_for(tab, lambda: tab.input_value("#skill-string") == 'move{to="lab"}')
    tab.click("#call >> text=Call")
    wait_for(tab, lambda: daemon.count("POST", "skiller/call") == 1)
    tab.goto(f"{site.url}#/skills/jump")
    tab.wait_for_selector("h3 >> text=Calls of jump")
    assert tab.locator("#calls li").count() == 0


def test_search_finds_all_kinds_by_keys(tab, site, daemon):
    daemon.answers |= {
        "clips-executive/goals": [goal_model("VISIT-LAB")],
        "clips/executive/facts": [fact_model(9, "(lab open)")],
        "cxbridge/rules": [{"name": "lab-open", "module": "MAIN", "agenda": 0}],
        "skiller/skills": [{"name": "go-lab"}],
        "blackboard/interfaces": [{"type": "LabInterface", "id": "x", "writer": "", "readers": []}],
    }
    daemon.send_events(
        {"kind": "log", "time_us": START_US, "component": "C", "level": "I", "text": "in the lab now"}
    )
    tab.goto(f"{site.url}#/blackboard")
    tab.wait_for_selector("#main h2")
    tab.keyboard.press("Control+k")
    tab.wait_for_selector("#palette[open]")
    tab.keyboard.type("lab")
    kinds = tab.locator(".found .kind")
    expected = {"Goal", "Rule", "Skill", "Interface", "Fact", "Log"}
    wait_for(tab, lambda: expected <= set(kinds.all_inner_texts()))
    tab.keyboard.press("Control+a")
    tab.keyboard.type("rule lab")
    wait_for(tab, lambda: kinds.all_inner_texts() == ["Rule"])
    tab.keyboard.press("Enter")
    tab.wait_for_url("**/#/clips/rules/lab-open")
