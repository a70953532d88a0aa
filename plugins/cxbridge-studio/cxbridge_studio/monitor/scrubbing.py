"""A recorded run whose state is known at any position, i.e. after any number of events.

States are stored at intervals. The state at a position is the last stored state up to there, changed by the
events since.
"""

from __future__ import annotations

import time
from array import array
from bisect import bisect_right
from collections.abc import Iterator
from typing import Final

from cxbridge.errors import TraceError
from cxbridge.events import Event, LogLine, SkillStatus
from cxbridge.history.monotonic import MonotonicClock
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.trace.formats.base import Run
from cxbridge_studio.recorded_state import RunState

MAX_EVENTS: Final = 1_000_000  # limit of the loaded events, which take about 1 GB of memory

# events between two stored states; a jump to a position applies at most this number of events
STATE_STRIDE: Final = 10_000

_BATCH_SIZE: Final = 500  # events that are read between two checks of the time


class Scrubber:
    """A run that is loaded step by step, and its state at a position.

    :param run: the recording.
    :param stride: the number of events between two stored states.
    """

    def __init__(self, run: Run, stride: int = STATE_STRIDE) -> None:
        self.run = run
        self._reader: Iterator[Event] | None = iter(run)
        self._stride = stride
        self._clock = MonotonicClock(run.start_us)
        self._stored_states = [RunState()]
        self._state_at_end = RunState()  # the state after all loaded events
        # the last skill string and status, by environment and Skiller
        self._statuses: dict[tuple[str, str], tuple[str, str]] = {}
        self.events: list[Event] = []
        self.times = array("q")  # microseconds since the start of the run, never decreasing
        # the positions at which the last event is a transition that changes a state
        self.transitions = array("q")
        self.log_lines = array("q")  # the indices of the events that are log lines
        self.position = 0
        self.state = RunState()
        self.notes: list[str] = []

    @property
    def is_loading(self) -> bool:
        """Whether further events are to be read."""
        return self._reader is not None

    @property
    def start_clock_us(self) -> int:
        """The time of the run's clock at the start of the run; all other times count from there."""
        return self._clock.start_us or 0

    @property
    def end_us(self) -> int:
        """The time of the last loaded event, in microseconds since the start of the run."""
        return self.times[-1] if self.times else 0

    @property
    def now_us(self) -> int:
        """The time of the last event before the current position, in microseconds since the start."""
        return self.times[self.position - 1] if self.position else 0

    def load(self, duration_s: float) -> None:
        """Read further events for a duration, or to the end of the run.

        If a part cannot be read, :attr:`notes` reports that, and the events before that part stay.
        """
        end_s = time.monotonic() + duration_s
        while self._reader is not None and time.monotonic() < end_s:
            self._load_batch(self._reader)

    def _load_batch(self, reader: Iterator[Event]) -> None:
        try:
            for _ in range(_BATCH_SIZE):
                event = next(reader, None)
                if event is None:
                    self._end_loading()
                    return
                self._add_event(event)
        except TraceError as error:
            self._end_loading(f"the rest cannot be read: {error.message}")
            return
        if len(self.events) >= MAX_EVENTS:
            self._end_loading(
                f"only the first {len(self.events)} events are shown; 'cxbridge trace cat' has all"
            )

    def _end_loading(self, *notes: str) -> None:
        self._reader = None
        self.notes += [*notes, *self.run.notes, *self._clock.describe_setbacks()]

    def _add_event(self, event: Event) -> None:
        if not event.KIND.name:  # no event for users: it has neither a name nor a line to show
            return
        event_index = len(self.events)
        self.events.append(event)
        self.times.append(self._clock.advance_to(event.time_us))
        self._state_at_end.add_event(event)
        if isinstance(event, LogLine):
            self.log_lines.append(event_index)
        elif isinstance(event, TRANSITION_TYPES) and self._changes_state(event):
            self.transitions.append(event_index + 1)
        if len(self.events) % self._stride == 0:
            self._stored_states.append(self._state_at_end.copy())

    def _changes_state(self, event: Event) -> bool:
        """Return whether a transition changes a state, and remember the status of a Skiller.

        A Skiller repeats its status without a change.
        """
        if not isinstance(event, SkillStatus):
            return True
        key, status = (event.env, event.skiller), (event.skill_string, event.status)
        previous_status = self._statuses.get(key)
        self._statuses[key] = status
        return status != previous_status

    def go_to(self, position: int) -> None:
        """Go to the position after a number of events, or to the nearest end of the loaded events."""
        position = max(0, min(position, len(self.events)))
        stored_index = position // self._stride
        # not on the way forward within a stride, where the current state is nearer than the stored state
        if position < self.position or stored_index > self.position // self._stride:
            self.state = self._stored_states[stored_index].copy()
            self.position = stored_index * self._stride
        for event in self.events[self.position : position]:
            self.state.add_event(event)
        self.position = position

    def step_transitions(self, count: int) -> None:
        """Go forward or back by a number of transitions."""
        transitions = self.transitions
        passed_count = bisect_right(transitions, self.position)
        if count < 0 and passed_count and transitions[passed_count - 1] < self.position:
            count += 1  # the first step back is to the last transition before the current position
        # the positions before, at and after the transitions: 0, the transitions, and the end of the run
        positions = (0, *transitions, len(self.events))
        self.go_to(positions[max(0, min(passed_count + count, len(transitions) + 1))])

    def go_to_time(self, time_us: int) -> None:
        """Go to the position after all events up to a time, in microseconds since the start of the run."""
        self.go_to(bisect_right(self.times, time_us))
