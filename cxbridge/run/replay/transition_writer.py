"""Records what a replayed run decides, to be compared with the recorded run."""

from __future__ import annotations

from pathlib import Path

from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event, EventBus, RuleFired
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge.trace.recorder import Recorder


class _TransitionWriter(McapWriter):
    """Keeps what is compared, and the rules that led to it if they are watched."""

    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:  # noqa: ARG002 - always the same
        """Return the types of events that are kept."""
        return frozenset((*TRANSITION_TYPES, RuleFired))


def record_transitions(bus: EventBus, file: Path) -> Recorder:
    """Return a recorder of the transitions of a run; to be used with ``with``."""
    return Recorder(bus, [_TransitionWriter(file)])
