"""The source of the monitor for a recorded run: shows the state at a position, which commands move.

Each snapshot reads a further slice of the recording, so that the first screen of a long recording appears at
once.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from math import isfinite
from pathlib import Path
from typing import Final

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import CxbridgeError, TraceError
from cxbridge.events import Event, LogLine
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.interfaces.assignments import field_text
from cxbridge.trace.codec import values_with_enum_names
from cxbridge.trace.formats.base import Run
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.listing import event_line
from cxbridge_studio.debugger.breakpoints import describe_transition
from cxbridge_studio.debugger.command_words import execute_command
from cxbridge_studio.monitor.filtering import filter_goals, format_duration, make_filtered_table
from cxbridge_studio.monitor.scrubbing import Scrubber
from cxbridge_studio.monitor.snapshot import (
    MAX_LINES,
    MAX_ROWS,
    GoalRow,
    LogRow,
    MonitorSnapshot,
    Table,
    ViewQuery,
)

_FIRST_LOAD_S: Final = 0.5  # the time for reading before the first screen
# the time for reading before a snapshot, short so that the screen stays responsive
_LOAD_SLICE_S: Final = 0.15
_IDLE_PERIOD_S: Final = 0.3  # the time between two snapshots after the recording is loaded
_BUSY_PERIOD_S: Final = 0.05  # the time between two snapshots while the recording loads
# limit of the shown events before the current position, and of those after it; chosen freely
_EVENTS_EACH_SIDE: Final = MAX_ROWS // 4

COMMANDS_HELP: Final = "event N, transition N, begin, end, jump SECONDS"


class RecordedSource:
    """A recording through which the user moves.

    The first position is the last transition, since an agent may retract its goals afterwards.

    :raises TraceError: if the file is not a recording or has no events.
    """

    is_live = False

    def __init__(self, path: Path) -> None:
        self.name = path.name or str(path)
        self._scrubber = Scrubber(open_run(path))
        self._scrubber.load(_FIRST_LOAD_S)
        if not self._scrubber.events:
            raise TraceError(
                "; ".join(self._scrubber.notes) or "this recording has no events",
                file=path,
                hint="'cxbridge trace info' lists its contents",
            )
        self._follows_end = True  # until the user moves, the position follows the last loaded transition
        # the position up to which the last explanation of the run goes, and its lines
        self._last_story: tuple[int, Sequence[str]] = (-1, ())
        self._commands: dict[str, Callable[[str], str]] = {
            "event": lambda count: self._move(
                lambda scrubber: scrubber.go_to(scrubber.position + _parse_integer(count))
            ),
            "transition": lambda count: self._move(
                lambda scrubber: scrubber.step_transitions(_parse_integer(count))
            ),
            "begin": lambda _: self._move(lambda scrubber: scrubber.go_to(0)),
            "end": lambda _: self._move(lambda scrubber: scrubber.go_to(len(scrubber.events))),
            "jump": self._jump,
        }

    @property
    def period_s(self) -> float:
        return _BUSY_PERIOD_S if self._scrubber.is_loading else _IDLE_PERIOD_S

    def close(self) -> None:
        """Do nothing: the readers of recordings close their files."""

    # -- commands

    def execute_command(self, command: str) -> str:
        """Execute a command of :data:`COMMANDS_HELP`.

        :raises CxbridgeError: if the command is unknown, or its argument is not a number.
        """
        return execute_command(self._commands, command, COMMANDS_HELP)

    def _move(self, move: Callable[[Scrubber], None]) -> str:
        self._follows_end = False
        move(self._scrubber)
        return ""

    def _jump(self, text: str) -> str:
        seconds = _parse_number(text.removesuffix("s").strip())
        return self._move(lambda scrubber: scrubber.go_to_time(round(seconds * MICROSECONDS)))

    # -- reading

    def take_snapshot(self, query: ViewQuery) -> MonitorSnapshot:
        """Return the state at the current position, and read a further slice of the recording."""
        scrubber = self._scrubber
        if scrubber.is_loading:
            scrubber.load(_LOAD_SLICE_S)
        if self._follows_end:
            scrubber.go_to(scrubber.transitions[-1] if scrubber.transitions else len(scrubber.events))
        return MonitorSnapshot(
            head=self._describe_position(),
            stop=self._describe_last_event(),
            # in a recording without times, the number of events counts
            progress=scrubber.now_us / scrubber.end_us
            if scrubber.end_us
            else scrubber.position / len(scrubber.events),
            goals=filter_goals(self._make_goal_rows(), query.filter_text),
            actions=make_filtered_table(self._make_action_rows(), query.filter_text, "plan-actions"),
            skills=make_filtered_table(self._make_skill_rows(), query.filter_text, "Skillers"),
            interfaces=make_filtered_table(self._make_interface_rows(), query.filter_text, "interfaces"),
            fields=self._make_field_table(query.interface),
            facts=self._make_fact_table(query) if query.pane == "facts" else Table(),
            events=self._make_event_table() if query.pane == "events" else Table(),
            log=self._make_log_rows(),
            story=self._refresh_story() if query.pane == "story" else (),
            environments=sorted({env for env, _ in scrubber.state.goals} | set(scrubber.state.facts.by_env)),
            notes=scrubber.notes,
        )

    def _refresh_story(self) -> Sequence[str]:
        """Return the explanation of the run up to the position."""
        scrubber = self._scrubber
        position, story = self._last_story
        if position != scrubber.position:
            is_at_end = scrubber.position == len(scrubber.events) and not scrubber.is_loading
            at_s = None if is_at_end else scrubber.now_us / MICROSECONDS
            story = _explain_run(LoadedRun(scrubber.run, scrubber.events), at_s)
            self._last_story = scrubber.position, story
        return story

    def _describe_position(self) -> str:
        scrubber = self._scrubber
        now_s, end_s = scrubber.now_us / MICROSECONDS, scrubber.end_us / MICROSECONDS
        times = f"{format_duration(now_s)} of {format_duration(end_s)}"
        position = f"event {scrubber.position:,} of {len(scrubber.events):,}"
        return " · ".join((times, position, *(["reading"] if scrubber.is_loading else [])))

    def _describe_last_event(self) -> str:
        """Return the last transition among the shown events before the position, or else the last event."""
        scrubber = self._scrubber
        if not scrubber.position:
            return "the beginning"
        recent_events = scrubber.events[max(0, scrubber.position - _EVENTS_EACH_SIDE) : scrubber.position]
        shown_event = next(
            (event for event in reversed(recent_events) if isinstance(event, TRANSITION_TYPES)),
            recent_events[-1],
        )
        return (
            describe_transition(shown_event)
            if isinstance(shown_event, TRANSITION_TYPES)
            else event_line(shown_event)
        )

    def _make_goal_rows(self) -> list[GoalRow]:
        state = self._scrubber.state
        return [
            GoalRow(
                env,
                goal.goal,
                goal.goal_class,
                goal.parent,
                goal.mode,
                goal.outcome,
                goal.error,
            )
            for (env, name), goal in state.goals.items()
            if state.has_goal(env, name)
        ]

    def _make_action_rows(self) -> Iterator[tuple[str, ...]]:
        state = self._scrubber.state
        arguments: dict[tuple[str, ...], str] = {}
        for env in state.facts.by_env:
            for slots in state.facts.read_slots(env, "plan-action"):
                key = tuple(slots.get(slot, "") for slot in ("goal-id", "plan-id", "id"))
                arguments[env, *key] = slots.get("param-values", "")
        for key, action in state.actions.items():
            env, goal, _, _ = key
            # without retracted plan-actions, which only a recording with facts reveals
            if key in arguments or "plan-action" not in state.facts.templates.get(env, ()):
                yield goal, action.action_id, action.action, arguments.get(key, ""), action.state

    def _make_skill_rows(self) -> Iterator[tuple[str, ...]]:
        skills = self._scrubber.state.skills
        has_several_envs = len({env for env, _ in skills}) > 1
        for (env, skiller), skill in sorted(skills.items()):
            yield f"{env}/{skiller}" if has_several_envs else skiller, skill.skill_string, skill.status

    def _make_interface_rows(self) -> Iterator[tuple[str, ...]]:
        for uid, write in sorted(self._scrubber.state.interfaces.items()):
            seconds = (write.time_us - self._scrubber.start_clock_us) / MICROSECONDS
            yield uid, f"at {format_duration(seconds)}", ""

    def _make_field_table(self, uid: str) -> Table:
        write = self._scrubber.state.interfaces.get(uid)
        if write is None:
            return Table(note="the interface has not been written yet" if uid else "")
        return Table(
            [(name, field_text(value)) for name, value in values_with_enum_names(write.values).items()]
        )

    def _make_fact_table(self, query: ViewQuery) -> Table:
        facts = self._scrubber.state.facts.by_env.get(query.env)
        if facts is None:
            return Table(note=f"no facts of {query.env} are recorded: --trace-level facts records them")
        return make_filtered_table(
            ((f"f-{index}", fact.text) for index, fact in facts.items()), query.filter_text, "facts"
        )

    def _make_event_table(self) -> Table:
        scrubber = self._scrubber
        first_index = max(0, scrubber.position - _EVENTS_EACH_SIDE)
        rows = [
            (f"{scrubber.times[index] / MICROSECONDS:.3f}", event.KIND.name, event_line(event))
            for index, event in enumerate(
                scrubber.events[first_index : scrubber.position + _EVENTS_EACH_SIDE], first_index
            )
        ]
        # The last event before the position is selected.
        return Table(rows, selected=scrubber.position - first_index - 1 if scrubber.position else None)

    def _make_log_rows(self) -> list[LogRow]:
        scrubber = self._scrubber
        line_count = bisect_left(scrubber.log_lines, scrubber.position)
        return [
            LogRow(
                index,
                event.level.value,
                f"{scrubber.times[index] / MICROSECONDS:9.3f} {event.component}: {event.text}",
            )
            for index in scrubber.log_lines[max(0, line_count - MAX_LINES) : line_count]
            if isinstance(event := scrubber.events[index], LogLine)
        ]


class LoadedRun(Run):
    """A recording whose events are in memory.

    :param run: the recording.
    :param events: the events of the recording.
    """

    def __init__(self, run: Run, events: Sequence[Event]) -> None:
        super().__init__(run.path)
        self._run, self._events = run, events
        # everything except the events comes from the recording; mypy refuses an assignment to a method
        self.metadata = run.metadata  # type: ignore[method-assign]
        self.files = run.files  # type: ignore[method-assign]
        self.source_records = run.source_records  # type: ignore[method-assign]

    def __iter__(self) -> Iterator[Event]:
        return iter(self._events)


def _explain_run(run: Run, at_s: float | None) -> Sequence[str]:
    """Return the explanation of a run up to a time, or the reason why there is none."""
    from cxbridge_studio.explain.answer import explain  # noqa: PLC0415 - slow, and only for the story
    from cxbridge_studio.explain.recorded import RecordedEvidence  # noqa: PLC0415 - slow, and only for the story

    try:
        return explain(RecordedEvidence(run, at_s, None), "", "run").lines
    except CxbridgeError as error:
        return (error.message, error.hint or "")


def _parse_number(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = float("nan")
    if not isfinite(number):
        raise CxbridgeError(f"'{text}' is not a number", hint=COMMANDS_HELP)
    return number


def _parse_integer(text: str) -> int:
    return int(_parse_number(text))
