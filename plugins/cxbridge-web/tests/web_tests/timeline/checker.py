"""Checks trace events: the demands of the format's description, and of Perfetto's importer."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

NAMES = {"process_name", "thread_name", "process_sort_index", "thread_sort_index"}
REQUIRED = {
    "M": {"name", "args"},
    "B": {"name", "cat", "args"},
    "E": {"name"},
    "i": {"name", "s"},
    "C": {"name", "args"},
    "s": {"name", "cat", "id"},
    "t": {"name", "cat", "id"},
    "f": {"name", "cat", "id", "bp"},
}


def load(path: Path) -> list[dict[str, Any]]:
    """Return the events of a file, checked."""
    document = json.loads(path.read_text(encoding="utf-8"))
    assert set(document) == {"displayTimeUnit", "otherData", "traceEvents"}
    events: list[dict[str, Any]] = document["traceEvents"]
    check(events)
    return events


def check(events: list[dict[str, Any]]) -> None:
    """Check events."""
    named: dict[str, set[object]] = {name: set() for name in NAMES}
    for event in events:
        assert REQUIRED[event["ph"]] <= set(event), event
        assert all(type(event[key]) is int and event[key] >= 0 for key in ("pid", "tid")), event
        assert event["ts"] >= 0
        assert type(event["ts"]) is int or event["ph"] == "i"
        assert isinstance(event.get("name"), str)
        assert event["name"], event
        if event["ph"] == "M":
            number = event["tid"] if event["name"].startswith("thread") else event["pid"]
            assert number not in named[event["name"]], "named twice; only the tid distinguishes threads"
            named[event["name"]].add(number)
        elif event["ph"] == "C":
            assert all(type(value) in {int, float} for value in event["args"].values())
    _check_tracks([event for event in events if event["ph"] != "M"], named)


def _check_tracks(events: list[dict[str, Any]], named: dict[str, set[object]]) -> None:
    """Slices nest within their thread; flows begin, continue and end within slices, in order."""
    stacks: dict[tuple[int, int], list[dict[str, Any]]] = {}
    flows: dict[int, list[str]] = {}
    # an importer sorts by time, and keeps the order of equal times
    for event in sorted(events, key=lambda each: each["ts"]):
        assert event["pid"] in named["process_name"]
        assert event["tid"] in named["thread_name"]
        stack = stacks.setdefault((event["pid"], event["tid"]), [])
        if event["ph"] == "B":
            stack.append(event)
        elif event["ph"] == "E":
            assert stack, f"ends nothing: {event}"
            assert stack.pop()["name"] == event["name"], event
        elif event["ph"] in "stf":
            assert stack, f"a flow outside of any slice: {event}"
            flows.setdefault(event["id"], []).append(event["ph"])
    assert not any(stacks.values()), "not ended"
    for phases in flows.values():
        assert phases == ["s", *["t"] * (len(phases) - 2), "f"]


def counts(events: list[dict[str, Any]]) -> Counter[str]:
    """How many events of each phase and category there are."""
    return Counter(f"{event['ph']} {event.get('cat', '')}".strip() for event in events)


def threads(events: list[dict[str, Any]]) -> list[str]:
    """The names of the threads, in the order of their sort indices."""
    index = {e["tid"]: e["args"]["sort_index"] for e in events if e["name"] == "thread_sort_index"}
    names = {e["tid"]: e["args"]["name"] for e in events if e["name"] == "thread_name"}
    return [names[tid] for tid in sorted(names, key=lambda each: index[each])]
