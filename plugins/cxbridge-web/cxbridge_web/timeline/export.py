"""Writing of a run as Chrome trace events to a file."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

from cxbridge.file_access import replacing
from cxbridge.history.keeping import cut
from cxbridge.history.linking import links
from cxbridge.trace.formats.base import Run
from cxbridge_web.timeline.events import Events, Track, Tracks
from cxbridge_web.timeline.goals import OPEN, GoalTracks, add_goals
from cxbridge_web.timeline.model import ReportLimits, RunModel
from cxbridge_web.timeline.reading import LONGEST_VALUE, read
from cxbridge_web.timeline.skiller_writes import SkillerWrites

# Limits higher than those of a page, since trace viewers handle more data.
LIMITS = ReportLimits(
    goals=100_000,
    actions=300_000,
    calls=100_000,
    transitions=3_000_000,
    log=500_000,
    writes=500_000,
    firings=500_000,
)

BIN_US = 100_000  # width in microseconds of the bins in which firings are counted

_RATE = "fired in 0.1 s"
_LEVELS = {"D": "debug", "I": "info", "W": "warning", "E": "error"}


def write_timeline(run: Run, output: Path) -> tuple[int, list[str]]:
    """Write a run as trace events.

    :returns: the number of written events, and warnings for the user.
    """
    model = read(run, LIMITS)
    count = 0
    with replacing(output) as fresh, fresh.open("w", encoding="utf-8", errors="backslashreplace") as file:
        other = _dump({**run.metadata(), "run": run.path.name, "notes": model.notes})
        file.write(f'{{"displayTimeUnit":"ms","otherData":{other},"traceEvents":[\n')
        for event in trace_events(model):
            file.write(",\n" if count else "")
            file.write(_dump(event))
            count += 1
        file.write("\n]}\n")
    return count, model.notes


def _dump(value: Any) -> str:
    """Encode a value as JSON without escapes, which Perfetto would show."""
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"))


def trace_events(model: RunModel) -> Iterator[dict[str, Any]]:
    """Yield the trace events: names of processes and threads, then the run's events in order."""
    tracks, events = Tracks(), Events()
    envs = dict.fromkeys(
        [
            *(goal.env for goal in model.history.goals),
            *(action.env for action in model.history.actions),
            *(rule.env for rule in model.rules),
        ]
    )
    processes = {env: tracks.process(f"environment {env}") for env in envs}
    goal_tracks = add_goals(model.history, tracks, events, processes)
    _add_rules(model, tracks, events, processes)
    skillers = _add_calls(model, tracks, events)
    interfaces = _add_interfaces(model, tracks, events)
    _add_flows(model, events, goal_tracks, skillers, interfaces)
    _add_log(model, tracks, events)
    return chain(tracks.names, events)


def _add_rules(model: RunModel, tracks: Tracks, events: Events, processes: dict[str, int]) -> None:
    """Add the firings of each environment, their rate, and the number of facts."""
    lines = {
        env: tracks.thread(process, "rules")
        for env, process in processes.items()
        if any(rule.env == env for rule in model.rules)
    }
    bins: dict[tuple[str, int], int] = {}
    for seq, time, number in model.firings.items():
        rule = model.rules[number]
        events.instant(lines[rule.env], rule.name, (seq, time), {}, category="rule")
        key = rule.env, time // BIN_US
        bins[key] = bins.get(key, 0) + 1
    for (env, at), count in bins.items():
        # counters are independent of slices, so their order does not matter
        events.counter(lines[env], "rules", (0, at * BIN_US), {_RATE: count})
        if (env, at + 1) not in bins:
            events.counter(lines[env], "rules", (0, (at + 1) * BIN_US), {_RATE: 0})
    if model.facts:
        counters = tracks.thread(next(iter(processes.values()), 0) or tracks.process("facts"), "facts")
        for seq, time, count in model.facts:
            events.counter(counters, "facts", (seq, time), {"since the begin": count})


def _add_calls(model: RunModel, tracks: Tracks, events: Events) -> dict[tuple[str, str], Track]:
    """Add the skills of each Skiller and the calls of planners; return the tracks of the Skillers."""
    skiller_tracks: dict[tuple[str, str], Track] = {}
    if not model.history.calls and not model.history.planner_calls:
        return skiller_tracks
    process = tracks.process("skills")
    end = model.history.events, model.history.end
    for call in model.history.calls:
        key = call.env, call.skiller
        if key not in skiller_tracks:
            skiller_tracks[key] = tracks.thread(process, call.skiller)
        facts: dict[str, Any] = {"skill": call.skill_string, "msgid": call.msgid, "status": call.status}
        if call.error:
            facts["error"] = cut(call.error, LONGEST_VALUE)
        if call.end is None:
            facts["note"] = OPEN
        events.slice(
            skiller_tracks[key], call.skill_string, call.begin, call.end or end, facts, category="skill"
        )
    lanes: list[tuple[Track, int]] = []
    for span in model.history.planner_calls:
        lane = next((number for number, (_, busy) in enumerate(lanes) if busy <= span.begin[0]), len(lanes))
        if lane == len(lanes):
            lanes.append((tracks.thread(process, "planner"), -1))
        span_end = span.end or end
        lanes[lane] = lanes[lane][0], span_end[0]
        facts = {"goal": span.goal, "status": span.status, "text": span.text}
        events.slice(lanes[lane][0], span.name, span.begin, span_end, facts, category="planner")
    return skiller_tracks


def _add_interfaces(model: RunModel, tracks: Tracks, events: Events) -> list[Track]:
    if not model.interfaces:
        return []
    process = tracks.process("interfaces")
    interface_tracks = [tracks.thread(process, each.uid) for each in model.interfaces]
    end = model.history.events, model.history.end
    last: dict[int, tuple[int, int, dict[str, str]]] = {}

    def close(number: int, until: tuple[int, int]) -> None:
        seq, time, changed = last[number]
        text = ", ".join(f"{name}={value}" for name, value in changed.items())
        events.slice(interface_tracks[number], text, (seq, time), until, changed, category="interface")

    for seq, time, number, changed in model.changes.items():
        if number in last:
            close(number, (seq, time))
        last[number] = seq, time, changed
    for number in last:
        close(number, end)
    for seq, time, number, text in model.messages.items():
        events.instant(interface_tracks[number], text, (seq, time), {"message": text}, category="message")
    return interface_tracks


def _add_flows(
    model: RunModel,
    events: Events,
    goal_tracks: GoalTracks,
    skillers: dict[tuple[str, str], Track],
    interfaces: list[Track],
) -> None:
    """Add arrows: action, write that reports the skill's begin, skill, write that reports its end."""
    changes = model.changes.items()

    def write(place: int | None) -> list[tuple[Track, tuple[int, int]]]:
        if place is None:
            return []
        seq, time, number, _ = changes[place]
        return [(interfaces[number], (seq, time))]

    writes = SkillerWrites(model)
    for number, link in enumerate(links(model.history), start=1):
        skill = skillers[link.call.env, link.call.skiller], link.call.begin
        began, ended = writes.of(link.call, link.ordered[0])
        steps = [(goal_tracks.actions[link.action.number], link.ordered), *write(began), skill, *write(ended)]
        events.flow(number, f"{link.word}skill of an action", steps)


def _add_log(model: RunModel, tracks: Tracks, events: Events) -> None:
    """Add the log lines, one track per component."""
    if not model.components:
        return
    process = tracks.process("log")
    component_tracks = [tracks.thread(process, name) for name in model.components]
    lines = [(*line, level) for level, kept in model.log.items() for line in kept.items()]
    for seq, time, component, text, level in sorted(lines):
        facts = {"level": _LEVELS[level], "text": text}
        events.instant(component_tracks[component], f"{level} {text}", (seq, time), facts, category="log")
