"""Contents, requests and changes of the views with a fake daemon."""

from __future__ import annotations

import pytest

from web_tests.page.conftest import PHONE, wait_for
from web_tests.page.fake import START_US, fact_model, goal_event, goal_model

VIEWS = ("timeline", "goals", "skills", "blackboard", "plot", "world", "clips", "log")
DOT = """digraph say { graph [rankdir="TB"]; node [shape="rect"]; START [color="#ffc080"];
 SPEAK [color="#ff8000", active="true"]; FINAL [color="#6fdd6f", shape="doubleoctagon"];
 FAILED [color="#ff8080", shape="doubleoctagon"];
 START -> SPEAK [taillabel="1", color="#ff8000", label="ready"]; SPEAK -> FINAL [label="spoken"];
 SPEAK -> START [label="again"]; SPEAK -> FAILED [label="a \\"quoted\\" reason"]; }"""
STOP = {
    "kind": "before",
    "reason": "before rule goal-expand",
    "breakpoint": 3,
    "rule": "goal-select",
    "next_rule": "goal-expand",
    "loop": 12,
    "fired": 4,
    "time_us": START_US,
}
HOSTILE = '<img src=x onerror="alert(1)">\u202e'
WHY = {
    "where": "a test",
    "notes": [],
    "goals": [
        {
            "cause": {"text": "G waits", "because": [{"text": f"G: it is young {HOSTILE}", "because": []}]},
            "moments": [{"seconds": 1.5, "text": "FORMULATED", "rules": ["some-rule"]}],
        }
    ],
}


@pytest.mark.smoke
def test_tree_of_goals_follows_events(tab, site, daemon):
    daemon.answers["clips-executive/goals"] = [
        goal_model("ROOT", "DISPATCHED", **{"sub-type": "RUN-ALL-OF-SUBGOALS"}),
        goal_model("LEAF", "SELECTED", parent="ROOT"),
    ]
    tab.goto(f"{site.url}#/goals")
    rows = tab.get_by_role("treeitem")
    tab.wait_for_selector('[role=treeitem][aria-level="2"]')
    assert rows.count() == 2
    daemon.send_events(goal_event("LEAF", "FINISHED", "FAILED", parent="ROOT", error="NO-WAY"))
    tab.wait_for_selector("[role=treeitem] .o-failed >> text=failed")
    assert "no way" in rows.nth(1).inner_text()


def test_event_during_request_is_in_history_once(tab, site):
    """A page that opens during a run must not show the transitions of a goal twice."""
    tab.goto(site.url)
    modes = ["FORMULATED", "SELECTED", "EXPANDED"]
    history, mode = tab.evaluate(
        """async ([events, older]) => {
          const { Model } = await import("cx/model.js");
          const model = new Model();
          const ask = async () => events.forEach((event) => model.apply(event));
          await model.update(ask, () => model.goalsAre(older));
          const goal = model.goals.get("G");
          return [model.changesOf(goal).map(({ mode }) => mode), goal.mode];
        }""",
        [[goal_event("G", mode) for mode in modes], [goal_model("G", "SELECTED")]],
    )
    assert (history, mode) == (modes, "EXPANDED")


def test_selected_goal_shows_plan_and_cause(tab, site, daemon):
    action = {
        "id": 1,
        "operator-name": "move",
        "param-values": ["a", "b"],
        "state": "PENDING",
        "executable": True,
    }
    plan = {"id": "P", "goal-id": "G", "cost": 2.5, "actions": [action]}
    daemon.answers |= {
        "clips-executive/goals": [goal_model("G", plans=["P"])],
        "clips-executive/goals/G": goal_model("G", plans=["P"], parameters=["speed", "fast"]),
        "clips-executive/plans/G/P": plan,
        "cxbridge/why": {"kind": "Answer", "lines": [], "data": WHY},
    }
    tab.goto(f"{site.url}#/goals/G")
    tab.wait_for_selector(".action >> text=move")
    assert "speed fast" in tab.locator("#goal").inner_text()
    event = {"kind": "plan-action", "time_us": START_US, "env": "executive", "action_id": "1"}
    daemon.send_events(event | {"goal": "G", "plan": "P", "action": "move", "state": "RUNNING"})
    tab.wait_for_selector(".action >> text=RUNNING")
    tab.click("#why")
    tab.wait_for_selector("#why-text .causes >> text=it is young")
    assert HOSTILE.replace("\u202e", r"\u202e") in tab.locator("#why-text").inner_text()
    assert tab.locator("#why-text .causes a").get_attribute("href") == "#/goals/G"


def test_many_facts_follow_events_and_are_found(tab, site, daemon):
    daemon.answers["clips/executive/facts"] = [
        fact_model(n, f"(thing (number {n}))") for n in range(1, 10_001)
    ]
    tab.goto(f"{site.url}#/clips/facts")
    tab.wait_for_selector("text=10000")
    assert tab.get_by_role("option").count() < 80
    reads = daemon.count("GET", "clips/executive/facts")
    fact = {"kind": "fact", "time_us": START_US, "env": "executive", "template": "thing"}
    daemon.send_events(*({**fact, "asserted": False, "index": n, "text": ""} for n in range(1, 5001)))
    daemon.send_events({**fact, "asserted": True, "index": 10_001, "text": "(thing (number new))"})
    tab.wait_for_selector(".count:text-is('5001')")
    tab.keyboard.press("/")
    tab.keyboard.type("number new")
    tab.wait_for_selector("text=f-10001")
    assert tab.get_by_role("option").count() == 1
    assert daemon.count("GET", "clips/executive/facts") == reads


@pytest.mark.smoke
def test_refused_call_shows_error_and_keeps_text(tab, site, daemon):
    daemon.refusal = "there is no skill 'dor'"
    tab.goto(f"{site.url}#/skills")
    tab.fill("#skill-string", "dor{}")
    tab.click("#call >> text=Call")
    tab.wait_for_selector(".toast.bad >> text=no skill")
    assert tab.input_value("#skill-string") == "dor{}"


def test_row_redrawn_between_press_and_release_is_selected(tab, site, daemon):
    daemon.answers["clips-executive/goals"] = [goal_model("A"), goal_model("B")]
    tab.goto(f"{site.url}#/goals")
    tab.hover("[role=treeitem] >> text=B")
    tab.mouse.down()
    daemon.send_events(goal_event("B", "SELECTED"), goal_event("C", "FORMULATED"))
    tab.wait_for_selector(".count:text-is('3')")
    tab.mouse.up()
    tab.wait_for_selector("#goal h2:text-is('B')")
    tab.wait_for_selector("[role=treeitem] >> text=SELECTED")


def test_each_selected_rule_is_shown(tab, site, daemon):
    """The detail needs no further request of the list of rules."""
    daemon.answers |= {"cxbridge/rules": [{"name": "goal-expand"}, {"name": "goal-select"}]}
    tab.goto(f"{site.url}#/clips/rules")
    for name in ("goal-expand", "goal-select") * 2:
        tab.click(f"[role=option] >> text={name}")
        tab.wait_for_selector(f".detail h2 >> text={name}")
        tab.wait_for_selector("#why-rule")


@pytest.mark.smoke
def test_skill_is_drawn_called_and_stopped(tab, site, daemon):
    daemon.answers |= {
        "skiller/skills": [{"name": "say"}, {"name": "goto"}],
        "skiller/skills/active": {
            "name": "ACTIVE",
            "graph": DOT,
            "skill-string": "say{}",
            "status": "RUNNING",
        },
    }
    tab.goto(f"{site.url}#/skills")
    tab.wait_for_selector("#machine tr[aria-current=step]:has-text('SPEAK')")
    states = tab.locator("#machine tbody tr").all_inner_texts()
    assert [text.split("\t")[0] for text in states] == ["START", "▶ SPEAK", "✓ FINAL", "✗ FAILED"]
    assert tab.locator("#machine .taken").all_inner_texts() == ["1: ready → SPEAK"]
    assert 'a "quoted" reason → FAILED' in states[1]
    tab.fill("#skill-string", 'say{text="x"}')
    tab.keyboard.press("Enter")
    wait_for(tab, lambda: ("POST", "skiller/call", {"skill_string": 'say{text="x"}'}) in daemon.requests)
    tab.click("#stop-skill")
    wait_for(tab, lambda: ("DELETE", "skiller/skills/active", None) in daemon.requests)


@pytest.mark.parametrize("text", ["", "digraph {", "graph x {}", "digraph x { A -> A; A -> B; B -> A }"])
def test_invalid_graph_does_not_break_view(tab, site, daemon, text):
    active = {"name": "ACTIVE", "graph": text, "skill-string": "x{}", "status": "FINAL"}
    daemon.answers["skiller/skills/active"] = active
    tab.goto(f"{site.url}#/skills")
    tab.wait_for_selector("#skill-now >> text=x{}")


@pytest.mark.smoke
def test_interface_shows_live_values_and_sends_message(tab, site, daemon):
    fields = [{"name": "x", "type": "float", "is_array": False, "enums": []},
              {"name": "mode", "type": "Mode", "is_array": False, "enums": ["OFF", "ON"]}]  # fmt: skip
    info = {
        "id": "Base/1",
        "type": "MotorInterface",
        "hash": "ab",
        "writer": "motor",
        "readers": ["nav"],
        "fields": fields,
    }
    daemon.answers |= {
        "blackboard/interfaces": [{**info, "message_types": [{"name": "GotoMessage", "fields": fields}]}],
        "blackboard/interfaces/MotorInterface/Base/1/data": {
            "data": {"x": 0.5, "mode": "OFF"},
            "timestamp": "then",
        },
    }
    tab.goto(f"{site.url}#/blackboard")
    tab.click("text=Base/1")
    tab.wait_for_selector("#values td >> text=0.5")
    daemon.send_events(
        {"kind": "interface", "time_us": START_US, "uid": "MotorInterface::Base/1", "values": {"x": 2.25}}
    )
    tab.wait_for_selector("#values td >> text=2.25")
    tab.fill("#message input", "1.5")
    tab.select_option("#message .fields select", "ON")
    tab.click("#message button")
    tab.wait_for_selector("text=GotoMessage sent, number 12")
    path = "cxbridge/blackboard/MotorInterface/Base/1/messages"
    assert ("POST", path, {"type": "GotoMessage", "fields": {"x": 1.5, "mode": "ON"}}) in daemon.requests


@pytest.mark.smoke
def test_log_is_filtered_by_level_and_text(tab, site, daemon):
    line = {"kind": "log", "time_us": START_US, "component": "Test"}
    daemon.send_events(*({**line, "level": level, "text": f"line {level} {HOSTILE}"} for level in "DIWE"))
    tab.goto(f"{site.url}#/log")
    tab.wait_for_selector("text=3 of 4")
    tab.get_by_role("checkbox", name="debug").check()
    wait_for(tab, lambda: tab.get_by_role("option").count() == 4)
    tab.fill(".find", "line w")
    wait_for(tab, lambda: tab.get_by_role("option").count() == 1)
    assert (
        "\\u202e" in tab.get_by_role("option").inner_text()
        or "\u202e" in tab.get_by_role("option").inner_text()
    )


@pytest.mark.smoke
def test_page_shows_lost_connection_and_reconnects(tab, site, daemon):
    daemon.answers["clips-executive/goals"] = [goal_model("BEFORE")]
    tab.goto(site.url)
    tab.wait_for_selector("[role=treeitem] >> text=BEFORE")
    site.stop()
    tab.wait_for_selector("#lost:visible")
    assert tab.locator("#pause").is_disabled()
    daemon.answers["clips-executive/goals"] = [goal_model("AFTER")]
    site.start()
    tab.wait_for_selector("#lost", state="hidden")
    tab.wait_for_selector("[role=treeitem] >> text=AFTER")


def test_page_forgets_events_of_earlier_daemon(tab, site, daemon):
    line = {"kind": "log", "time_us": START_US, "component": "Test", "level": "I", "text": "of the first"}
    daemon.send_events(line)
    tab.goto(f"{site.url}#/log")
    tab.wait_for_selector("[role=option] >> text=of the first")
    site.stop()
    tab.wait_for_selector("#lost:visible")
    daemon.epoch = "b"
    site.start()
    tab.wait_for_selector("text=Nothing logged yet")


def test_page_shows_missed_events_and_reloads(tab, site, daemon):
    tab.goto(site.url)
    tab.wait_for_selector("#state >> text=RUNNING")
    wait_for(tab, lambda: daemon.count("GET", "clips-executive/goals") == 1)
    daemon.send_events({"kind": "dropped", "count": 12})
    tab.wait_for_selector("text=Missed 12 events")
    wait_for(tab, lambda: daemon.count("GET", "clips-executive/goals") == 2)


@pytest.mark.smoke
@pytest.mark.parametrize("view", VIEWS)
def test_empty_view_fits_telephone(tab, site, view):
    tab.set_viewport_size(PHONE)
    tab.goto(f"{site.url}#/{view}")
    tab.wait_for_selector("#main h2")
    assert tab.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
    assert tab.locator("#nav a[aria-current=page]").count() == 1


def test_header_shows_breakpoint_and_resumes(tab, site, daemon):
    daemon.stopped = STOP
    tab.goto(site.url)
    tab.wait_for_selector("#state[title*='before rule goal-expand'] >> text=BREAK")
    tab.click("#pause >> text=Resume")
    wait_for(tab, lambda: daemon.count("POST", "cxbridge/resume") == 1)


@pytest.mark.smoke
def test_buttons_are_disabled_without_remote_control(tab, site, daemon):
    daemon.remote_control = False
    tab.goto(f"{site.url}#/skills")
    tab.wait_for_selector("#read-only >> text=remote-control is off")
    for name in ("Pause", "Stop", "Call"):
        button = tab.get_by_role("button", name=name, exact=True)
        assert button.is_disabled(), name
        assert "remote-control is off" in button.get_attribute("title"), name
