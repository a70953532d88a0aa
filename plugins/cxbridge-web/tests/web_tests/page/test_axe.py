"""The accessibility of all views after axe-core, light and dark, on a desk and on a telephone."""

from __future__ import annotations

from importlib import resources
from typing import Any

import pytest

from cxbridge_web import pages
from tests.support import needs_full, share
from web_tests.page.conftest import DESK, PHONE
from web_tests.page.fake import START_US, fact_model, goal_event, goal_model
from web_tests.page.test_map import GRAPH, pose, transform
from web_tests.page.test_panes import RULE, action_event, skill_event

ADDRESSES = (
    "timeline/goal/A",
    "goals/A",
    "goals?goal=",
    "clips/rules/open-door",
    "skills/move",
    "nowhere",
    "plot/Position3DInterface%3A%3Ar1.translation%5B0%5D/loop",
    "world",
)
RUN = """
async ([theme, options]) => {
  const checked = (window.checked ??= new Set());
  const frame = [...document.querySelectorAll("#head > *, #nav > *, body > :not(#head, #nav, #main)")];
  const key = (part) => theme + part.parentElement.id + part.outerHTML;
  const { violations } = await axe.run(
    { include: [document], exclude: frame.filter((part) => checked.has(key(part))) },
    { resultTypes: ["violations"], ...options },
  );
  for (const part of frame) checked.add(key(part));
  return violations
    .filter((violation) => /serious|critical/.test(violation.impact))
    .map((violation) => violation.id + " " + violation.nodes[0].html);
}
"""
"""The frame of a view, four fifths of the elements, is rechecked only after a change."""
COLOUR_RULES = ("color-contrast", "link-in-text-block")
COLOURS: dict[str, Any] = {"runOnly": [*COLOUR_RULES]}
"""The rules of colours: a theme changes only colours, neither elements nor places."""
PLACES: dict[str, Any] = {"rules": {rule: {"enabled": False} for rule in COLOUR_RULES}}
"""All rules but those of colours: a telephone changes only places, and has the colours of the desk."""
LOOKS: dict[str, list[tuple[str, dict[str, Any]]]] = {
    "desk": [("light", {}), ("dark", COLOURS)],
    "phone": [("light", PLACES)],
}
THEME = (
    "async (theme) => { (await import('cx/theme.js')).applyTheme(theme);"
    " await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))); }"
)


def find_violations(page, where: str) -> dict[str, list[str]]:
    """Return the serious violations of the page in its themes."""
    violations: dict[str, list[str]] = {}
    for theme, options in LOOKS["phone" if page.viewport_size == PHONE else "desk"]:
        page.evaluate(THEME, theme)
        if messages := page.evaluate(RUN, [theme, options]):
            violations[f"{where}, {theme}"] = messages
    return violations


def find_past_violations(page) -> dict[str, list[str]]:
    """Return the violations at a past moment of the live run, in views with and without past data."""
    page.evaluate("async (time) => (await import('cx/app.js')).app.select({ time })", START_US - 1)
    violations: dict[str, list[str]] = {}
    for view in ("log", "goals", "clips"):
        page.click(f"nav a[data-view={view}]")
        page.wait_for_selector("#scrub:visible")
        page.wait_for_timeout(300)
        violations |= find_violations(page, f"past of {view}")
    page.click("#to-live")
    return violations


@pytest.fixture
def axe():
    """The source text of axe-core."""
    pytest.importorskip("axe_playwright_python", reason="needs axe-playwright-python")
    return resources.files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8")


@pytest.mark.smoke
@pytest.mark.parametrize("size", [DESK, pytest.param(PHONE, marks=needs_full)], ids=["desk", "phone"])
def test_views_have_no_serious_violation(browser, site, daemon, axe, size):
    daemon.environments = ["executive", "lab"]
    daemon.answers |= {
        "clips-executive/goals": [goal_model("A", "DISPATCHED"), goal_model("B", "RETRACTED", parent="A")],
        "clips-executive/plans": [],
        "clips/executive/facts": [fact_model(7, "(door (open FALSE))")],
        "cxbridge/navgraphs": [GRAPH],
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
    }
    daemon.send_events(
        goal_event("C", "RETRACTED", "FAILED", error="STUCK"),
        action_event("A", "1", "RUNNING"),
        skill_event('move{to="lab"}', "S_FAILED"),
        pose(61, 1.0, 0.5),
        transform("map", "odom", 1.0, 0.0),
        *(
            {"kind": "log", "time_us": START_US, "component": "C", "level": each, "text": "x"}
            for each in "IWE"
        ),
    )
    context = browser.new_context(reduced_motion="reduce", bypass_csp=True, viewport=size)
    page = context.new_page()
    page.goto(site.url)
    page.evaluate(f"() => {{ {axe} }}")  # the page's policy forbids a script element
    violations: dict[str, list[str]] = {}
    for view in share([*pages.list_views(), *ADDRESSES], 10):
        page.goto(f"{site.url}#/{view}")
        page.wait_for_selector("#main h2:visible")
        page.wait_for_timeout(300)
        violations |= find_violations(page, view)
    violations |= find_past_violations(page)
    page.keyboard.press("Control+k")
    page.keyboard.type("a")
    page.wait_for_selector(".found")
    violations |= find_violations(page, "search")
    context.close()
    assert violations == {}
