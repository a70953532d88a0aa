"""Writes a run as Chrome trace events to a file, for Perfetto.

Goals, skills, interfaces and log components are tracks with slices or instants; arrows lead from an action to
the skill that it called.
"""

from __future__ import annotations

import json
from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Iterator
from itertools import chain
from operator import itemgetter
from pathlib import Path
from typing import Any, Final

from cxbridge.file_access import replaced_file
from cxbridge.history.builder import ENDED, RUNNING
from cxbridge.history.linking import find_skill_links
from cxbridge.history.model import SkillExecution
from cxbridge.history.truncation import truncate
from cxbridge.trace.formats.base import Run
from cxbridge_web.timeline.events import Lanes, Moment, TraceEvents, Track, Tracks
from cxbridge_web.timeline.goals import OPEN_NOTE, add_goals
from cxbridge_web.timeline.reading import BIN_US, MAX_VALUE_LENGTH, TimelineData, read_timeline

_RATE_NAME: Final = "fired in 0.1 s"  # name of the counter of firings by bin
_LEVELS: Final = {"D": "debug", "I": "info", "W": "warning", "E": "error"}
_SKILLER_PREFIX: Final = "SkillerInterface::"


def write_timeline(run: Run, output: Path) -> tuple[int, list[str]]:
    """Write a run as trace events.

    :returns: the number of written events, and warnings for the user.
    """
    data = read_timeline(run)
    count = 0
    with (
        replaced_file(output) as new_file,
        new_file.open("w", encoding="utf-8", errors="backslashreplace") as file,
    ):
        metadata = _encode_json({**run.metadata(), "run": run.path.name, "notes": data.notes})
        file.write(f'{{"displayTimeUnit":"ms","otherData":{metadata},"traceEvents":[\n')
        for event in make_trace_events(data):
            file.write(",\n" if count else "")
            file.write(_encode_json(event))
            count += 1
        file.write("\n]}\n")
    return count, data.notes


def _encode_json(value: Any) -> str:
    """Encode a value as JSON without escapes of characters, which Perfetto would show."""
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"))


def make_trace_events(data: TimelineData) -> Iterator[dict[str, Any]]:
    """Yield the trace events: names of processes and threads, then the run's events in order."""
    tracks, events = Tracks(), TraceEvents()
    environments = dict.fromkeys(
        [
            *(goal.env for goal in data.history.goals),
            *(action.env for action in data.history.actions),
            *(env for _, env, _ in data.firings.items()),
        ]
    )
    processes = {env: tracks.add_process(f"environment {env}") for env in environments}
    actions = add_goals(data.history, tracks, events, processes)
    _add_rules(data, tracks, events, processes)
    skillers = _add_calls(data, tracks, events)
    interfaces = _add_interfaces(data, tracks, events)
    _add_flows(data, events, actions, skillers, interfaces)
    _add_log(data, tracks, events)
    return chain(tracks.names, events)


def _add_rules(data: TimelineData, tracks: Tracks, events: TraceEvents, processes: dict[str, int]) -> None:
    """Add the firings of each environment, their rate, and the number of facts."""
    environments = {env for _, env, _ in data.firings.items()}
    env_tracks = {
        env: tracks.add_track(process, "rules") for env, process in processes.items() if env in environments
    }
    firing_counts: Counter[tuple[str, int]] = Counter()
    for moment, env, rule in data.firings.items():
        events.add_instant(env_tracks[env], rule, moment, {}, category="rule")
        firing_counts[env, moment[1] // BIN_US] += 1
    for (env, number), count in firing_counts.items():
        # counters are independent of slices, so their order does not matter
        events.add_counter(env_tracks[env], "rules", (0, number * BIN_US), {_RATE_NAME: count})
        if (env, number + 1) not in firing_counts:  # viewers keep the last value of a counter
            events.add_counter(env_tracks[env], "rules", (0, (number + 1) * BIN_US), {_RATE_NAME: 0})
    if data.facts:
        track = tracks.add_track(next(iter(processes.values()), 0) or tracks.add_process("facts"), "facts")
        for moment, count in data.facts.values():
            events.add_counter(track, "facts", moment, {"since the beginning": count})


def _add_calls(data: TimelineData, tracks: Tracks, events: TraceEvents) -> dict[tuple[str, str], Track]:
    """Add the skills of each Skiller and the calls of planners; return the tracks of the Skillers."""
    skiller_tracks: dict[tuple[str, str], Track] = {}
    if not data.history.calls and not data.history.planner_calls:
        return skiller_tracks
    process = tracks.add_process("skills")
    end = data.history.event_count, data.history.end
    for call in data.history.calls:
        key = call.env, call.skiller
        if key not in skiller_tracks:
            skiller_tracks[key] = tracks.add_track(process, call.skiller)
        args: dict[str, Any] = {"skill": call.skill_string, "msgid": call.msgid, "status": call.status}
        if call.error:
            args["error"] = truncate(call.error, MAX_VALUE_LENGTH)
        if call.end is None:
            args["note"] = OPEN_NOTE
        events.add_slice(
            skiller_tracks[key], call.skill_string, call.begin, call.end or end, args, category="skill"
        )
    lanes = Lanes(tracks, process, "planner")  # several planners may work at the same time
    for plan in data.history.planner_calls:
        args = {"goal": plan.goal, "status": plan.status, "text": plan.text}
        track = lanes.reserve_track(plan.begin, plan.end or end)
        events.add_slice(track, plan.name, plan.begin, plan.end or end, args, category="planner")
    return skiller_tracks


def _add_interfaces(data: TimelineData, tracks: Tracks, events: TraceEvents) -> dict[str, Track]:
    """Add a slice from each change of an interface to the next change; return the interfaces' tracks."""
    if not data.interfaces:
        return {}
    process = tracks.add_process("interfaces")
    interface_tracks = {uid: tracks.add_track(process, uid) for uid in data.interfaces}
    last_changes: dict[str, tuple[Moment, dict[str, str]]] = {}

    def add_slice(uid: str, end: Moment) -> None:
        begin, changed_fields = last_changes[uid]
        text = ", ".join(f"{name}={value}" for name, value in changed_fields.items())
        events.add_slice(interface_tracks[uid], text, begin, end, changed_fields, category="interface")

    for moment, uid, changed_fields in data.changes.items():
        if uid in last_changes:
            add_slice(uid, moment)
        last_changes[uid] = moment, changed_fields
    for uid in last_changes:
        add_slice(uid, (data.history.event_count, data.history.end))
    for moment, uid, text in data.messages.items():
        events.add_instant(interface_tracks[uid], text, moment, {"message": text}, category="message")
    return interface_tracks


def _add_flows(
    data: TimelineData,
    events: TraceEvents,
    actions: dict[int, Track],
    skillers: dict[tuple[str, str], Track],
    interfaces: dict[str, Track],
) -> None:
    """Add an arrow from each action to its skill.

    The arrow leads over the write that reports the start of the skill, and ends at the write that reports its
    end.
    """
    writes = _SkillerWrites(data)
    for number, link in enumerate(find_skill_links(data.history), start=1):
        call = link.call
        begin_write, end_write = writes.find_begin_and_end(call, link.ordered_at[0])
        interface = interfaces.get(f"{_SKILLER_PREFIX}{call.skiller}")
        steps = [
            (actions[link.action.number], link.ordered_at),
            (interface, begin_write),
            (skillers[call.env, call.skiller], call.begin),
            (interface, end_write),
        ]
        visible_steps = [
            (track, moment) for track, moment in steps if track is not None and moment is not None
        ]
        events.add_flow(number, f"{link.guess_prefix}skill of an action", visible_steps)


class _SkillerWrites:
    """The changes of each Skiller's interface in order, to find the changes that belong to a skill."""

    def __init__(self, data: TimelineData) -> None:
        self._changes: dict[str, list[tuple[int, Moment, dict[str, str]]]] = {}
        for moment, uid, changed_fields in data.changes.items():
            self._changes.setdefault(uid, []).append((moment[0], moment, changed_fields))

    def find_begin_and_end(
        self, call: SkillExecution, order_number: int
    ) -> tuple[Moment | None, Moment | None]:
        """Return the writes that reported a skill's begin and end; None for a missing write.

        :param order_number: the number of the event that ordered the skill.
        """
        # The executive reads an interface after its write, so the write precedes the events about the skill.
        begin, end = call.begin[0], call.end[0] if call.end else call.begin[0]
        begin_writes = [
            moment
            for moment, changed_fields in self._find_changes(call.skiller, order_number, begin)
            if changed_fields.get("status") == RUNNING or "msgid" in changed_fields
        ]
        end_writes = [
            moment
            for moment, changed_fields in self._find_changes(call.skiller, begin, end)
            if changed_fields.get("status") in ENDED
        ]
        return begin_writes[-1] if begin_writes else None, end_writes[-1] if end_writes else None

    def _find_changes(self, skiller: str, after: int, before: int) -> list[tuple[Moment, dict[str, str]]]:
        """Return the changes of a Skiller's interface between two events of the run."""
        changes = self._changes.get(f"{_SKILLER_PREFIX}{skiller}", [])
        first_index = bisect_right(changes, after, key=itemgetter(0))
        last_index = bisect_left(changes, before, key=itemgetter(0))
        return [(moment, changed_fields) for _, moment, changed_fields in changes[first_index:last_index]]


def _add_log(data: TimelineData, tracks: Tracks, events: TraceEvents) -> None:
    """Add the log lines, one track per component."""
    lines = sorted((*line, level.value) for level, log_list in data.log.items() for line in log_list.items())
    if not lines:
        return
    process = tracks.add_process("log")
    components = dict.fromkeys(component for _, component, _, _ in lines)
    component_tracks = {name: tracks.add_track(process, name) for name in components}
    for moment, component, text, level in lines:
        args = {"level": _LEVELS[level], "text": text}
        events.add_instant(component_tracks[component], f"{level} {text}", moment, args, category="log")
