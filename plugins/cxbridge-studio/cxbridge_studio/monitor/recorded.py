"""The monitor's source for a recorded run: scrubs, plays and shows the run at a moment.

The recording is read in slices between two keys, so that a long recording is shown at once.
"""

from __future__ import annotations

import time
from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from math import isfinite
from pathlib import Path
from typing import Final

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import CxbridgeError, TraceError
from cxbridge.events import Event, GoalTransition, LogLine, PlanActionTransition, SkillStatus
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.trace.codec import values_with_enum_names
from cxbridge.trace.formats.base import Run
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.listing import event_line
from cxbridge_studio.monitor.filtering import duration_text, filter_goals, page
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

_FIRST_S: Final = 0.5  # the seconds of reading before the first screen
_SLICE_S: Final = 0.15  # the seconds of reading between two keys, so that the screen stays responsive
_MAX_SPEED: Final = 1024.0  # times the recorded speed
_MIN_SPEED: Final = 1 / 16
_IDLE_PERIOD_S: Final = 0.3  # the seconds between two snapshots while the recording stands still
_BUSY_PERIOD_S: Final = 0.05  # the seconds between two snapshots while it plays or loads
_EVENTS_EACH_SIDE: Final = MAX_ROWS // 4  # the events shown before the moment, and after it

HELP: Final = "event N, transition N, begin, end, jump SECONDS, play, speed N"


class RecordedSource:
    """A recording to scrub, positioned at its last transition: the goals may be retracted after it.

    :param now: returns the time in seconds, by which the recording is played.
    :raises TraceError: if the file is not a recording or has no events.
    """

    is_live = False

    def __init__(self, path: Path, now: Callable[[], float] = time.monotonic) -> None:
        self.name = path.name or str(path)
        self._now = now
        self._scrubber = Scrubber(open_run(path))
        self._scrubber.load(_FIRST_S)
        if not self._scrubber.events:
            raise TraceError(
                "; ".join(self._scrubber.notes) or "this recording has no events",
                file=path,
                hint="'cxbridge trace info' lists its contents",
            )
        self._follows_end = True  # until the user moves: new events of the file are shown
        self._speed = 1.0
        # While playing: the seconds at which playing began, and the time of the run then.
        self._play_start: tuple[float, int] | None = None
        self._last_story: tuple[int, Sequence[str]] = (-1, ())  # the moment of the story, and its lines
        self._commands: dict[str, Callable[[str], str]] = {
            "event": lambda count: self._move(lambda scrubber: scrubber.go(scrubber.at + _integer(count))),
            "transition": lambda count: self._move(lambda scrubber: scrubber.go_transitions(_integer(count))),
            "begin": lambda _: self._move(lambda scrubber: scrubber.go(0)),
            "end": lambda _: self._move(lambda scrubber: scrubber.go(len(scrubber.events))),
            "jump": self._jump,
            "play": lambda _: self._play(),
            "speed": self._set_speed,
        }

    @property
    def period_s(self) -> float:
        return _BUSY_PERIOD_S if self._play_start is not None or self._scrubber.is_loading else _IDLE_PERIOD_S

    def close(self) -> None:
        """Do nothing: the file is already closed."""

    # -- commands

    def do(self, command: str, query: ViewQuery) -> str:  # noqa: ARG002 - the protocol's signature
        """Carry out a command of :data:`HELP`."""
        word, _, argument = command.strip().partition(" ")
        action = self._commands.get(word)
        if action is None:
            raise CxbridgeError(f"a recording knows no '{word}'", hint=HELP)
        return action(argument.strip())

    def _move(self, move: Callable[[Scrubber], None]) -> str:
        self._play_start, self._follows_end = None, False
        move(self._scrubber)
        return ""

    def _jump(self, text: str) -> str:
        seconds = _number(text.removesuffix("s").strip())
        return self._move(lambda scrubber: scrubber.go_time(round(seconds * MICROSECONDS)))

    def _play(self) -> str:
        """Play from the moment, or from the start if it is the end; while playing, stop."""
        if self._play_start is None and self._scrubber.at >= len(self._scrubber.events):
            self._scrubber.go(0)
        is_playing, self._follows_end = self._play_start is not None, False
        self._play_start = None if is_playing else (self._now(), self._scrubber.now_us)
        return ""

    def _set_speed(self, text: str) -> str:
        speed = {"+": self._speed * 2, "-": self._speed / 2}.get(text)
        self._speed = min(max(_number(text) if speed is None else speed, _MIN_SPEED), _MAX_SPEED)
        if self._play_start is not None:  # the new speed counts from here
            self._play_start = self._now(), self._scrubber.now_us
        return f"speed {self._speed:g}"

    # -- reading

    def look(self, query: ViewQuery) -> MonitorSnapshot:
        """Return the state at the current moment, and read more of the file."""
        scrubber = self._scrubber
        if scrubber.is_loading:
            scrubber.load(_SLICE_S)
        if self._play_start is not None:
            start_s, start_us = self._play_start
            scrubber.go_time(start_us + round((self._now() - start_s) * self._speed * MICROSECONDS))
            if scrubber.at >= len(scrubber.events) and not scrubber.is_loading:
                self._play_start = None
        elif self._follows_end:
            scrubber.go(scrubber.transitions[-1] if scrubber.transitions else len(scrubber.events))
        return MonitorSnapshot(
            head=self._head(),
            stop=self._last_event_text(),
            # A recording without times has its events instead.
            progress=scrubber.now_us / scrubber.end_us
            if scrubber.end_us
            else scrubber.at / len(scrubber.events),
            goals=filter_goals(self._goals(), query.words),
            actions=page(self._actions(), query.words, "plan-actions"),
            skills=page(self._skills(), query.words, "Skillers"),
            interfaces=page(self._interfaces(), query.words, "interfaces"),
            fields=self._fields(query.interface),
            facts=self._facts(query) if query.pane == "facts" else Table(),
            events=self._events() if query.pane == "events" else Table(),
            log=self._log(),
            story=self._story() if query.pane == "story" else (),
            environments=sorted({env for env, _ in scrubber.state.goals} | set(scrubber.state.facts.by_env)),
            notes=scrubber.notes,
        )

    def _story(self) -> Sequence[str]:
        """Return the story of the run up to the moment; while the recording plays, the story before."""
        scrubber = self._scrubber
        moment, story = self._last_story
        if moment != scrubber.at and (self._play_start is None or not story):
            is_at_end = scrubber.at == len(scrubber.events) and not scrubber.is_loading
            at_s = None if is_at_end else scrubber.now_us / MICROSECONDS
            story = _story_of(LoadedRun(scrubber.run, scrubber.events), at_s)
            self._last_story = scrubber.at, story
        return story

    def _head(self) -> str:
        scrubber = self._scrubber
        now_s, end_s = scrubber.now_us / MICROSECONDS, scrubber.end_us / MICROSECONDS
        words = [
            f"{duration_text(now_s)} of {duration_text(end_s)}",
            f"event {scrubber.at:,} of {len(scrubber.events):,}",
        ]
        if scrubber.is_loading:
            words.append("reading")
        if self._play_start is not None:
            words.append(f"playing x{self._speed:g}")
        return " · ".join(words)

    def _last_event_text(self) -> str:
        """Return the last transition before the moment, or else the last event."""
        scrubber = self._scrubber
        if not scrubber.at:
            return "the begin"
        recent = scrubber.events[max(0, scrubber.at - _EVENTS_EACH_SIDE) : scrubber.at]
        last = next((event for event in reversed(recent) if isinstance(event, TRANSITION_TYPES)), recent[-1])
        return f"{last.KIND.name} {event_text(last)}"

    def _goals(self) -> list[GoalRow]:
        state = self._scrubber.state
        return [
            GoalRow(
                env,
                goal.goal,
                goal.goal_class,
                goal.parent,
                goal.mode,
                goal.outcome,
                _without_nil(goal.error),
            )
            for (env, name), goal in state.goals.items()
            if state.has_goal(env, name)
        ]

    def _actions(self) -> Iterator[tuple[str, ...]]:
        state = self._scrubber.state
        arguments: dict[tuple[str, ...], str] = {}
        for env in state.facts.by_env:
            for slots in state.facts.slots(env, "plan-action"):
                key = tuple(slots.get(slot, "") for slot in ("goal-id", "plan-id", "id"))
                arguments[env, *key] = slots.get("param-values", "")
        for key, action in state.actions.items():
            env, goal, _, _ = key
            # A retracted plan-action is not shown, if the recording has the facts.
            if key in arguments or "plan-action" not in state.facts.templates.get(env, ()):
                yield goal, action.action_id, action.action, arguments.get(key, ""), action.state

    def _skills(self) -> Iterator[tuple[str, ...]]:
        skills = self._scrubber.state.skills
        has_several_envs = len({env for env, _ in skills}) > 1
        for (env, skiller), skill in sorted(skills.items()):
            yield f"{env}/{skiller}" if has_several_envs else skiller, skill.skill_string, skill.status

    def _interfaces(self) -> Iterator[tuple[str, ...]]:
        for uid, write in sorted(self._scrubber.state.interfaces.items()):
            seconds = (write.time_us - self._scrubber.start_us) / MICROSECONDS
            yield uid, f"at {duration_text(seconds)}", ""

    def _fields(self, uid: str) -> Table:
        write = self._scrubber.state.interfaces.get(uid)
        if write is None:
            return Table(note="it has not been written yet" if uid else "")
        return Table(
            [(name, value_text(value)) for name, value in values_with_enum_names(write.values).items()]
        )

    def _facts(self, query: ViewQuery) -> Table:
        facts = self._scrubber.state.facts.by_env.get(query.env)
        if facts is None:
            return Table(note=f"no facts of {query.env} are recorded: --trace-level facts records them")
        return page(((f"f-{index}", fact.text) for index, fact in facts.items()), query.words, "facts")

    def _events(self) -> Table:
        scrubber = self._scrubber
        first = max(0, scrubber.at - _EVENTS_EACH_SIDE)
        rows = [
            (f"{scrubber.times[number] / MICROSECONDS:.3f}", event.KIND.name, event_text(event))
            for number, event in enumerate(scrubber.events[first : scrubber.at + _EVENTS_EACH_SIDE], first)
        ]
        return Table(rows, selected=scrubber.at - first - 1 if scrubber.at else None)

    def _log(self) -> list[LogRow]:
        scrubber = self._scrubber
        last = bisect_left(scrubber.log_lines, scrubber.at)
        rows = []
        for number in scrubber.log_lines[max(0, last - MAX_LINES) : last]:
            event = scrubber.events[number]
            if isinstance(event, LogLine):
                text = f"{scrubber.times[number] / MICROSECONDS:9.3f} {event.component}: {event.text}"
                rows.append(LogRow(number, event.level.value, text))
        return rows


class LoadedRun(Run):
    """A recording whose events are in memory.

    :param run: the recording.
    :param events: the events of the recording.
    """

    def __init__(self, run: Run, events: Sequence[Event]) -> None:
        super().__init__(run.path)
        self._run, self._events = run, events
        self.metadata = run.metadata  # type: ignore[method-assign]
        self.files = run.files  # type: ignore[method-assign]
        self.source_records = run.source_records  # type: ignore[method-assign]

    def __iter__(self) -> Iterator[Event]:
        return iter(self._events)


def _story_of(run: Run, at_s: float | None) -> Sequence[str]:
    """Return the story of a run up to a moment, or the reason why there is none."""
    from cxbridge_studio.explain.answer import explain  # noqa: PLC0415 - slow, and only for the story
    from cxbridge_studio.explain.recorded import RecordedEvidence  # noqa: PLC0415 - slow, and only for the story

    try:
        return explain(RecordedEvidence(run, at_s, None), "", "run").lines
    except CxbridgeError as error:
        return (error.message, error.hint or "")


def event_text(event: Event) -> str:
    """Return the content of an event in a few words, without its kind."""
    if isinstance(event, GoalTransition):
        outcome = "" if event.outcome in {"", "UNKNOWN"} else f" {event.outcome}"
        error = f": {event.error}" if _without_nil(event.error) else ""
        return f"{event.goal} ({event.goal_class}) {event.mode}{outcome}{error}"
    if isinstance(event, PlanActionTransition):
        return f"{event.action} {event.state} ({event.action_id} of {event.goal})"
    if isinstance(event, SkillStatus):
        return f"{event.skiller}: {event.skill_string or 'no skill'} {event.status}"
    return event_line(event)


def value_text(value: object) -> str:
    if isinstance(value, list | tuple):
        return ",".join(value_text(item) for item in value)
    if isinstance(value, bool):
        return "true" if value else "false"
    return f'"{value}"' if isinstance(value, str) else str(value)


def _without_nil(error: str) -> str:
    """Return a goal's error; CLIPS' ``nil`` becomes the empty text."""
    return "" if error == "nil" else error


def _number(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = float("nan")
    if not isfinite(number):
        raise CxbridgeError(f"'{text}' is not a number", hint=HELP)
    return number


def _integer(text: str) -> int:
    return int(_number(text))
