"""The page with much to show: 1,000 goals, 10,000 facts, 100,000 events. Long tasks of the browser, per view.

Run with ``python -m benchmarks.bench_page``; needs playwright and an installed Chromium. A long task is one
that keeps the page from answering for more than 50 ms (the browser's own ``longtask`` entries).
"""

from __future__ import annotations

import sys
import time
from typing import Any

from playwright.sync_api import Page, sync_playwright

from tests.trace.html.browser import BROWSER
from tests.web.page.fake import START_US, FakeDaemon, fact_model, goal_event, goal_model, served

GOALS, FACTS, EVENTS = 1_000, 10_000, 100_000
LIMIT_MS = 100
WATCH = """
  window.tasks = [];
  new PerformanceObserver((list) => {
    for (const entry of list.getEntries()) window.tasks.push([entry.startTime, entry.duration]);
  }).observe({ type: "longtask", buffered: true });
"""
VIEWS = ("goals", "goals/G7", "skills", "domain", "domain/operators", "blackboard", "clips/facts", "clips/rules",
         "log", "config", "timeline")  # fmt: skip


def fill(daemon: FakeDaemon) -> None:
    """Give the daemon what it answers with."""
    goals = [f"G{number}" for number in range(GOALS)]
    daemon.answers |= {
        "clips-executive/goals": [
            goal_model(goal, "DISPATCHED", parent=f"G{number // 10}" if number else "")
            for number, goal in enumerate(goals)
        ],
        "clips-executive/domain-facts": [
            {"name": "at", "param-values": [f"thing{number}", f"place{number % 97}"]}
            for number in range(FACTS)
        ],
        "clips-executive/plans": [],
        "clips/executive/facts": [
            fact_model(number, f"(domain-fact (name at) (param-values thing{number} place{number % 97}))")
            for number in range(FACTS)
        ],
        "cxbridge/rules": [
            {"name": f"rule-{number}", "module": "MAIN", "agenda": 0, "firings": number}
            for number in range(300)
        ],
        "cxbridge/constructs": [],
    }


def events(count: int, begin: int) -> list[dict[str, Any]]:
    """Return events of a busy run: half of them goals and actions, the rest log lines and facts."""
    made: list[dict[str, Any]] = []
    for number in range(begin, begin + count):
        time_us, goal = START_US + number * 1_000, f"G{number % GOALS}"
        parent = f"G{number % GOALS // 10}" if number % GOALS else "nil"
        match number % 4:
            case 0:
                mode = ("SELECTED", "EXPANDED", "COMMITTED", "DISPATCHED")[number // 4 % 4]
                made.append(goal_event(goal, mode, parent=parent, time_us=time_us))
            case 1:
                state = ("PENDING", "WAITING", "RUNNING", "FINAL")[number // 4 % 4]
                made.append({"kind": "plan-action", "env": "executive", "goal": goal, "plan": "P", "action": "move",
                             "action_id": str(number % 9), "state": state, "time_us": time_us})  # fmt: skip
            case 2:
                made.append({"kind": "log", "level": "I", "component": "bench", "text": f"line {number}",
                             "time_us": time_us})  # fmt: skip
            case _:
                made.append({"kind": "fact", "env": "executive", "index": number % FACTS, "template": "domain-fact",
                             "text": f"(domain-fact (name at) (param-values thing{number % FACTS} place1))",
                             "asserted": True, "time_us": time_us})  # fmt: skip
    return made


def worst(page: Page, since: float) -> tuple[int, float]:
    """Return how many long tasks there were since then, and the longest in ms."""
    found = [length for begin, length in page.evaluate("window.tasks") if begin >= since]
    return sum(length > LIMIT_MS for length in found), max(found, default=0.0)


def main() -> int:
    """Print the long tasks of each view, while events come."""
    daemon, bad = FakeDaemon(), 0
    fill(daemon)
    with served(daemon) as site, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1600, "height": 900})
        page.add_init_script(WATCH)
        page.goto(f"{site.url}#/goals")
        page.wait_for_selector("[role=treeitem]")
        print(f"{'view':24}  over {LIMIT_MS} ms  longest (ms)")
        begin, each = 0, EVENTS // len(VIEWS)
        for view in VIEWS:
            since = page.evaluate("performance.now()")
            page.goto(f"{site.url}#/{view}")
            for _ in range(10):
                daemon.tell(*events(each // 10, begin))
                begin += each // 10
                page.wait_for_timeout(150)
            page.wait_for_timeout(1500)
            many, longest = worst(page, since)
            bad += many
            print(f"{view:24}  {many:11}  {longest:12.0f}")
        since = page.evaluate("performance.now()")
        page.keyboard.press("Control+k")
        for key in "g99":
            page.keyboard.press(key)
            time.sleep(0.2)
        page.wait_for_timeout(1000)
        many, longest = worst(page, since)
        print(f"{'search':24}  {many:11}  {longest:12.0f}")
        browser.close()
    return bad + many


if __name__ == "__main__":
    sys.exit(main() > 0)
