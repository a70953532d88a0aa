"""The page with 1,000 goals, 10,000 facts and 100,000 events: long tasks of the browser in each view.

Run with ``python -m benchmarks.bench_page [ROUNDS]``; needs playwright and an installed Chromium. A long
task keeps the page's main thread busy for more than 100 ms. The row ``nothing`` is an empty page: its tasks
show the delays that the machine adds. The first picture of a recording of the same events (20 MB) is the
time from the request for the page to the frame with the timeline, in a browser with an empty cache.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import msgspec
from playwright.sync_api import sync_playwright

from cxbridge.event_kinds import EVENT_TYPES, RecordLevel
from cxbridge.trace.formats.mcap.writer import McapWriter
from tests.trace.html.browser import BROWSER
from web_tests.page.fake import START_US, FakeDaemon, fact_model, goal_event, goal_model, serve_daemon
from web_tests.page.test_moments import serve_recordings

GOALS, FACTS, EVENTS = 1_000, 10_000, 100_000
LIMIT_MS = 100
PICTURE_LIMIT_MS = 1_000
VIEWS = ("goals", "goals/G7", "skills", "blackboard", "clips/facts",
         "clips/rules", "log", "plot", "world", "timeline")  # fmt: skip


def set_replies(daemon: FakeDaemon) -> None:
    """Let the daemon reply with a tree of goals, facts and 300 rules, without plans and constructs."""
    goals = [f"G{number}" for number in range(GOALS)]
    daemon.answers |= {
        "clips-executive/goals": [
            goal_model(goal, "DISPATCHED", parent=f"G{number // 10}" if number else "")
            for number, goal in enumerate(goals)
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


def make_events(count: int, begin: int) -> list[dict[str, Any]]:
    """Return the events of a busy run: half of them of goals and actions, the rest log lines and facts."""
    events: list[dict[str, Any]] = []
    for number in range(begin, begin + count):
        time_us, goal = START_US + number * 1_000, f"G{number % GOALS}"
        parent = f"G{number % GOALS // 10}" if number % GOALS else "nil"
        match number % 4:
            case 0:
                mode = ("SELECTED", "EXPANDED", "COMMITTED", "DISPATCHED")[number // 4 % 4]
                events.append(goal_event(goal, mode, parent=parent, time_us=time_us))
            case 1:
                state = ("PENDING", "WAITING", "RUNNING", "FINAL")[number // 4 % 4]
                events.append({"kind": "plan-action", "env": "executive", "goal": goal, "plan": "P",
                             "action": "move", "action_id": str(number % 9), "state": state,
                             "time_us": time_us})  # fmt: skip
            case 2:
                events.append({"kind": "log", "level": "I", "component": "bench", "text": f"line {number}",
                             "time_us": time_us})  # fmt: skip
            case _:
                events.append({"kind": "fact", "env": "executive", "index": number % FACTS,
                             "template": "domain-fact",
                             "text": f"(domain-fact (name at) (param-values thing{number % FACTS} place1))",
                             "asserted": True, "time_us": time_us})  # fmt: skip
    return events


def task_times_ms(trace: bytes) -> list[float]:
    """Return the times of the main thread's tasks in ms: processor times, or wall times without these."""
    trace_events = json.loads(trace)["traceEvents"]
    mains = {
        (event["pid"], event["tid"])
        for event in trace_events
        if event["name"] == "thread_name" and event["args"]["name"] == "CrRendererMain"
    }
    return [
        event.get("tdur", event.get("dur", 0)) / 1000
        for event in trace_events
        if event["name"] == "RunTask" and (event["pid"], event["tid"]) in mains
    ]


def trace_longest_task(browser: Any, page: Any, act: Callable[[], None]) -> float:
    """Return the time of the longest task during an action and shortly afterwards, in ms."""
    browser.start_tracing(page=page, categories=["disabled-by-default-devtools.timeline"])
    act()
    page.wait_for_timeout(1500)
    return max(task_times_ms(browser.stop_tracing()), default=0.0)


def measure(browser: Any) -> dict[str, float]:
    """Return the longest task in ms: of each view during events, of a search, and of an empty page."""
    daemon, begin, batch_size = FakeDaemon(), 0, EVENTS // len(VIEWS) // 10
    set_replies(daemon)
    with serve_daemon(daemon) as site:
        page = browser.new_page(viewport={"width": 1600, "height": 900})
        longest = {"nothing": trace_longest_task(browser, page, lambda: page.wait_for_timeout(1500))}

        def show(view: str) -> None:
            nonlocal begin
            page.goto(f"{site.url}#/{view}")
            for _ in range(10):
                daemon.send_events(*make_events(batch_size, begin))
                begin += batch_size
                page.wait_for_timeout(150)

        def search() -> None:
            page.keyboard.press("Control+k")
            for key in "g99":
                page.keyboard.press(key)
                page.wait_for_timeout(200)

        for view in VIEWS:
            longest[view] = trace_longest_task(browser, page, partial(show, view))
        longest["search"] = trace_longest_task(browser, page, search)
        page.close()
    return longest


def write_recording(path: Path) -> None:
    """Write a recording of EVENTS events."""
    with McapWriter(path) as writer:
        writer.event_types(RecordLevel.FACTS)
        for event in make_events(EVENTS, 0):
            writer.write(msgspec.convert(event, EVENT_TYPES[event["kind"]]))


def measure_first_picture_ms(browser: Any, url: str) -> float:
    """Return the ms until the page shows a recording: its timeline and all its moments."""
    page = browser.new_page(viewport={"width": 1600, "height": 900})
    page.add_init_script(
        """window.shown = new Promise((done) => {
          const look = () => document.querySelector(".tl canvas") &&
            requestAnimationFrame(() => setTimeout(() => done(performance.now())));
          new MutationObserver(look).observe(document, { childList: true, subtree: true });
        });"""
    )
    page.goto(url)
    shown: float = page.evaluate("window.shown")
    # the server still replies to requests of the page, which would slow down the next load
    page.wait_for_load_state("networkidle")
    assert "RECORDING" in page.inner_text("#state"), page.inner_text("body")
    page.context.close()
    return shown


def main(rounds: int = 3) -> int:
    """Print the first picture and the longest tasks: the median and the worst of the rounds.

    :returns: the number of medians above their limit.
    """
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        recording = Path(folder, "run.mcap")
        write_recording(recording)
        megabytes = recording.stat().st_size / 1e6
        with serve_recordings(recording) as (url, recordings):
            pictures = [measure_first_picture_ms(browser, url + recordings.start_path) for _ in range(rounds)]
        measured = [measure(browser) for _ in range(rounds)]
        browser.close()
    picture = median(pictures)
    print(f"first picture of a recording of {megabytes:.0f} MB: {picture:.0f} ms, worst {max(pictures):.0f}")
    print(f"{'view':24}  median  worst  (ms of the processor, {rounds} rounds)")
    medians = {view: median(times[view] for times in measured) for view in measured[0]}
    for view, length in medians.items():
        print(f"{view:24}  {length:6.0f}  {max(times[view] for times in measured):5.0f}")
    return sum(length > LIMIT_MS for length in medians.values()) + (picture > PICTURE_LIMIT_MS)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])) > 0)
