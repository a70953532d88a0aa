"""What the timeline costs a browser: 1,000 goals and 100,000 events are zoomed, scrolled and scrubbed.

It prints the frames (middle, 95 of 100, longest), and the tasks that kept the browser longer than 50 ms,
after the recording was read. Needs chromium and playwright.
"""

from __future__ import annotations

import json
import random
import sys

from tests.trace.html.browser import BROWSER
from web_tests.page.fake import START_US, FakeDaemon, goal_event, served

GOALS, LINES = 1000, 73
START = """
window.tasks = [];
new PerformanceObserver((list) => {
  for (const { duration } of list.getEntries()) tasks.push(Math.round(duration));
}).observe({ type: "longtask", buffered: true });
"""
FRAMES = """
window.frames_ = [];
let last = performance.now();
const frame = (now) => { frames_.push(now - last); last = now; requestAnimationFrame(frame); };
requestAnimationFrame(frame);
"""
TAKE = """() => {
  const sorted = frames_.splice(0).sort((a, b) => a - b);
  const at = (part) => sorted[Math.floor((sorted.length - 1) * part)];
  return [sorted.length, at(0.5), at(0.95), at(1), tasks.splice(0)];
}"""
WHEEL = """async () => {
  const chart = document.querySelector(".tl-chart"), { left, top } = chart.getBoundingClientRect();
  for (let turn = 0; turn < 120; turn++) {
    const place = { clientX: left + 400, clientY: top + 200, bubbles: true, cancelable: true };
    chart.dispatchEvent(new WheelEvent("wheel", { deltaY: turn < 60 ? -40 : 40, ...place }));
    await new Promise(requestAnimationFrame);
  }
}"""
SCROLL = """async () => {
  const names = document.querySelector(".tl-names");
  for (let turn = 0; turn < 120; turn++) { names.scrollTop += 40; await new Promise(requestAnimationFrame); }
}"""


def run() -> list[dict[str, object]]:
    """Return 1,000 goals with three actions and a skill each, and a log."""
    chance, events = random.Random(3), []

    def add(time, event):
        events.append(event | {"time_us": START_US + int(time)})

    for number in range(GOALS):
        begin, took = number * 300_000, chance.uniform(500_000, 4_000_000)
        goal = f"G{number}"
        outcome = chance.choice(["COMPLETED"] * 8 + ["FAILED", "REJECTED"])
        above = {"parent": f"G{number - number % 10}" if number % 10 else "nil"}
        for mode in ("FORMULATED", "SELECTED", "EXPANDED", "COMMITTED", "DISPATCHED"):
            add(begin, goal_event(goal, mode, **above))
        for place in range(3):
            action = {"kind": "plan-action", "env": "executive", "goal": goal, "plan": "P", "action": "move"}
            states = ("FORMULATED", "PENDING", "WAITING", "RUNNING", "EXECUTION-SUCCEEDED", "FINAL")
            for step, state in enumerate(states):
                add(
                    begin + (place + step / 5) * took / 3,
                    action | {"action_id": str(place + 1), "state": state},
                )
        skill = {"kind": "skill", "env": "executive", "skiller": f"robot{number % 4}", "msgid": number}
        for time, status in ((begin + 1000, "S_RUNNING"), (begin + 290_000, "S_FINAL")):
            add(time, skill | {"skill_string": f"move{{to={number}}}", "status": status})
        for mode in ("FINISHED", "EVALUATED", "RETRACTED"):
            add(begin + took, goal_event(goal, mode, outcome, **above))
        for line in range(LINES):
            level = "E" if line == 0 and outcome == "FAILED" else "I"
            text = {"kind": "log", "level": level, "component": "C", "text": f"line {line} of {goal}"}
            add(begin + line * 4000, text)
    return sorted(events, key=lambda event: event["time_us"])


def measure(tab, name, act) -> None:
    """Do something, and print what it cost."""
    tab.evaluate(TAKE)
    act()
    tab.wait_for_timeout(400)
    frames, middle, most, longest, tasks = tab.evaluate(TAKE)
    print(
        f"{name:8} {frames:4} frames of {middle:.1f} ms; 95 of 100 within {most:.1f}, longest {longest:.1f}"
    )
    if tasks:
        print(f"{'':8} tasks over 50 ms: {tasks}")


def main() -> None:
    if BROWSER is None:
        sys.exit("needs chromium or google-chrome on the path")
    from playwright.sync_api import sync_playwright

    daemon, events = FakeDaemon(), run()
    daemon.files["run.jsonl"] = "\n".join(map(json.dumps, events)).encode()
    with served(daemon) as site, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        tab = browser.new_page(viewport={"width": 1280, "height": 800})
        tab.add_init_script(START)
        tab.goto(f"{site.url}?run=files/run.jsonl#/timeline")
        tab.wait_for_selector("#state >> text=RECORDING", timeout=120_000)
        tab.wait_for_timeout(1500)
        print(
            f"{len(events)} events; tasks over 50 ms while they were read: {tab.evaluate('tasks.splice(0)')}"
        )
        tab.evaluate(FRAMES)
        measure(tab, "zoom", lambda: tab.evaluate(WHEEL))
        measure(tab, "open", lambda: tab.click("[aria-label='open all']"))
        measure(tab, "scroll", lambda: tab.evaluate(SCROLL))
        measure(tab, "zoom", lambda: tab.evaluate(WHEEL))
        box = tab.locator(".tl-chart").bounding_box()
        assert box is not None
        tab.mouse.move(box["x"] + 100, box["y"] + 8)
        tab.mouse.down()
        measure(tab, "scrub", lambda: tab.mouse.move(box["x"] + 800, box["y"] + 8, steps=60))
        tab.mouse.up()
        measure(tab, "in view", lambda: tab.click("text=in view"))
        measure(tab, "search", lambda: tab.fill(".tl .find", "g99"))
        browser.close()


if __name__ == "__main__":
    main()
