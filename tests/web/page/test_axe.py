"""Accessibility: axe-core finds nothing serious in any view, light and dark, on a desk and on a telephone."""

from __future__ import annotations

from importlib import resources

import pytest

from cxbridge.web import pages
from tests.web.page.conftest import DESK, PHONE
from tests.web.page.fake import START_US, fact_model, goal_event, goal_model
from tests.web.page.test_panes import DOMAIN, RULE, action_event, skill_event
from tests.web.page.test_views import STOP

ADDRESSES = (
    "goals/A",
    "goals?goal=",
    "blackboard/graph",
    "clips/environments",
    "clips/rules/open-door",
    "domain/operators/move",
    "skills/move",
    "config/components",
    "nowhere",
)
RUN = (
    "axe.run().then((all) => all.violations.filter((one) => /serious|critical/.test(one.impact))"
    ".map((one) => one.id + ' ' + one.nodes[0].html))"
)


@pytest.fixture
def axe():
    """The text of axe-core."""
    pytest.importorskip("axe_playwright_python", reason="needs axe-playwright-python")
    return resources.files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8")


@pytest.mark.parametrize("size", [DESK, PHONE], ids=["desk", "phone"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_serious(browser, site, daemon, axe, scheme, size):
    daemon.environments = ["executive", "lab"]
    daemon.answers |= {
        "clips-executive/goals": [goal_model("A", "DISPATCHED"), goal_model("B", "RETRACTED", parent="A")],
        "clips-executive/domain-operators": [{"name": "move", "wait-sensed": True, "parameters": []}],
        "clips-executive/plans": [],
        "clips/executive/facts": [
            fact_model(7, "(door (open FALSE))"),
            *map(fact_model, range(8, 18), DOMAIN),
        ],
        "blackboard/graph": {"dotgraph": 'digraph x { graph [rankdir=LR]; "A::a" -> { b c }; }'},
        "cxbridge/debugger": {"breakpoints": [{"number": 1, "spec": "rule:x"}], "stopped": STOP},
        "cxbridge/rules": [{"name": "open-door", "module": "MAIN", "agenda": 1, "firings": 3}],
        "cxbridge/constructs": [
            {
                "construct": "defrule",
                "name": "open-door",
                "file": "a.clp",
                "line": 1,
                "core": False,
                "text": RULE,
            }
        ],
        "blackboard/interfaces": [
            {"type": "SkillExecutorInterface", "id": "x", "writer": "w", "readers": []}
        ],
        "cxbridge/interfaces": [{"id": "x", "data": {"agent": "robot1", "skills": "move", "state": "IDLE"}}],
        "config": {"config": {"a": {"b": 1}}},
    }
    daemon.tell(
        goal_event("C", "RETRACTED", "FAILED", error="STUCK"),
        action_event("A", "1", "RUNNING"),
        skill_event('move{to="lab"}', "S_FAILED"),
        *(
            {"kind": "log", "time_us": START_US, "component": "C", "level": each, "text": "x"}
            for each in "IWE"
        ),
    )
    context = browser.new_context(
        color_scheme=scheme, reduced_motion="reduce", bypass_csp=True, viewport=size
    )
    page = context.new_page()
    page.goto(site.url)
    page.add_script_tag(content=axe)
    page.click("#debug-open")
    found: dict[str, list[str]] = {}
    for view in (*sorted(path.stem for path in pages.VIEWS.glob("*.js")), *ADDRESSES):
        page.goto(f"{site.url}#/{view}")
        page.wait_for_selector("#main h2:visible")
        page.wait_for_timeout(300)
        serious = page.evaluate(RUN)
        found |= {view: serious} if serious else {}
    page.keyboard.press("Control+k")
    page.keyboard.type("a")
    page.wait_for_selector(".found")
    if serious := page.evaluate(RUN):
        found["search"] = serious
    context.close()
    assert found == {}
