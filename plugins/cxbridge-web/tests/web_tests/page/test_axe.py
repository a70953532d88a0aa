"""Accessibility: axe-core finds nothing serious in any view, light and dark, on a desk and on a telephone."""

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
  const looked = (window.looked ??= new Set());
  const around = [...document.querySelectorAll("#head > *, #nav > *, body > :not(#head, #nav, #main)")];
  const name = (part) => theme + part.parentElement.id + part.outerHTML;
  const { violations } = await axe.run(
    { include: [document], exclude: around.filter((part) => looked.has(name(part))) },
    { resultTypes: ["violations"], ...options },
  );
  for (const part of around) looked.add(name(part));
  return violations
    .filter((one) => /serious|critical/.test(one.impact))
    .map((one) => one.id + " " + one.nodes[0].html);
}
"""
"""The frame of a view, four fifths of the elements, is checked again only after a change."""
OF_COLOURS = ("color-contrast", "link-in-text-block")
COLOURS: dict[str, Any] = {"runOnly": [*OF_COLOURS]}
"""The rules that look at colours. A theme changes nothing else: the elements and their places stay."""
PLACES: dict[str, Any] = {"rules": {rule: {"enabled": False} for rule in OF_COLOURS}}
"""The other rules. A telephone changes nothing but places: its colours are those of the desk."""
LOOKS: dict[str, list[tuple[str, dict[str, Any]]]] = {
    "desk": [("light", {}), ("dark", COLOURS)],
    "phone": [("light", PLACES)],
}
THEME = (
    "async (theme) => { (await import('cx/theme.js')).applyTheme(theme);"
    " await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))); }"
)


def serious(page, where: str) -> dict[str, list[str]]:
    """Check the page, in its light theme and in its dark one."""
    found: dict[str, list[str]] = {}
    for theme, options in LOOKS["phone" if page.viewport_size == PHONE else "desk"]:
        page.evaluate(THEME, theme)
        if wrong := page.evaluate(RUN, [theme, options]):
            found[f"{where}, {theme}"] = wrong
    return found


def past(page) -> dict[str, list[str]]:
    """Look at a moment of the live run, in a view that shows it and in one that cannot."""
    page.evaluate("async (time) => (await import('cx/app.js')).app.select({ time })", START_US - 1)
    found: dict[str, list[str]] = {}
    for view in ("log", "goals", "clips"):
        page.click(f"nav a[data-view={view}]")
        page.wait_for_selector("#scrub:visible")
        page.wait_for_timeout(300)
        found |= serious(page, f"past of {view}")
    page.click("#to-live")
    return found


@pytest.fixture
def axe():
    """The text of axe-core."""
    pytest.importorskip("axe_playwright_python", reason="needs axe-playwright-python")
    return resources.files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8")


@pytest.mark.smoke
@pytest.mark.parametrize("size", [DESK, pytest.param(PHONE, marks=needs_full)], ids=["desk", "phone"])
def test_axe_finds_nothing_serious(browser, site, daemon, axe, size):
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
    daemon.tell(
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
    page.evaluate(f"() => {{ {axe} }}")  # a script of the page itself would be against its policy
    found: dict[str, list[str]] = {}
    for view in share([*pages.list_views(), *ADDRESSES], 10):
        page.goto(f"{site.url}#/{view}")
        page.wait_for_selector("#main h2:visible")
        page.wait_for_timeout(300)
        found |= serious(page, view)
    found |= past(page)
    page.keyboard.press("Control+k")
    page.keyboard.type("a")
    page.wait_for_selector(".found")
    found |= serious(page, "search")
    context.close()
    assert found == {}
