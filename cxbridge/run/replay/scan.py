"""The parts of a recording that a replay needs, collected in one pass."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from cxbridge.errors import TraceError
from cxbridge.events import (
    Event,
    GoalTransition,
    InterfaceMessage,
    InterfaceWrite,
    LogLine,
    PlanActionTransition,
    PlannerCall,
    SkillStatus,
)
from cxbridge.history.forest import NO_PARENT
from cxbridge.trace.formats.base import Run

SKILLER: Final = "SkillerInterface"
EXECUTOR: Final = "SkillExecutorInterface"
SKILL_BOARD: Final = "SkillBoardInterface"

_LOG_FORMAT: Final = "fawkes-log"
_CLIPS_COMPONENT: Final = "CLIPS ("  # the start of the log name of a CLIPS environment: CLIPS (NAME)
_RETRACTED: Final = "RETRACTED"


@dataclass(slots=True)
class Scan:
    """The contents of one recording.

    :param shift_us: to be added to the recording's times, so that they fit those of the other recordings.
    :ivar first_writes: the first write of each interface by ``Type::id``, in order of appearance.
    :ivar skillers: the writes of each SkillerInterface, by interface id.
    :ivar executors: the writes of each SkillExecutorInterface, by interface id.
    :ivar messages: messages between skill board and executors.
    :ivar planner_calls: the starts and the ends of planner calls.
    :ivar statuses: the statuses of each Skiller that the executive has read, by interface id.
    :ivar begin_us: the start of the run; None without times, and if no event shows that the executive runs.
    :ivar end_us: the time of the last transition or skill status; 0 if there is none.
    :ivar transition_count: the number of transitions and skill statuses.
    :ivar has_goals: whether any transition is a goal's.
    :ivar envs: the environments of the transitions and skill statuses.
    """

    run: Run
    shift_us: int = 0
    first_writes: dict[str, InterfaceWrite] = field(default_factory=dict)
    skillers: dict[str, list[InterfaceWrite]] = field(default_factory=dict)
    executors: dict[str, list[InterfaceWrite]] = field(default_factory=dict)
    messages: list[InterfaceMessage] = field(default_factory=list)
    statuses: dict[str, list[SkillStatus]] = field(default_factory=dict)
    planner_calls: list[PlannerCall] = field(default_factory=list)
    metadata: dict[str, str] = field(default_factory=dict)
    begin_us: int | None = None
    end_us: int = 0
    transition_count: int = 0
    has_goals: bool = False
    envs: set[str] = field(default_factory=set)
    _root_modes: dict[tuple[str, str], str] = field(default_factory=dict)  # the latest mode of each root goal

    @property
    def is_log(self) -> bool:
        """Whether the recording is a text log, which has only times of day."""
        return self.run.format == _LOG_FORMAT

    @property
    def is_timed(self) -> bool:
        return self.run.is_timed

    @property
    def is_complete(self) -> bool:
        """Whether the recording is complete: it has goals, and all root goals are retracted.

        A recording with notes, e.g. about a truncation, is not complete.
        """
        return (
            self.has_goals
            and not self.run.notes
            and all(mode == _RETRACTED for mode in self._root_modes.values())
        )

    def add_event(self, event: Event) -> None:
        """Collect the parts of an event that a replay needs."""
        if self.begin_us is None and self.is_timed and self._shows_begin(event):
            self.begin_us = event.time_us
        if isinstance(event, InterfaceWrite):
            self._add_write(event)
        elif isinstance(event, InterfaceMessage):
            if event.uid.startswith((EXECUTOR, SKILL_BOARD)):
                self.messages.append(event)
        elif isinstance(event, PlannerCall):
            self.planner_calls.append(event)
        elif isinstance(event, (GoalTransition, PlanActionTransition, SkillStatus)):
            self.transition_count += 1
            self.envs.add(event.env)
            self.end_us = max(self.end_us, event.time_us)
            if isinstance(event, SkillStatus):
                self.statuses.setdefault(event.skiller, []).append(event)
            elif isinstance(event, GoalTransition):
                self._add_goal(event)

    def _shows_begin(self, event: Event) -> bool:
        """Return whether the event shows that the executive runs and its clock is set."""
        # the first lines of a log have times of the real clock, until a simulated clock is set
        return (
            not self.is_log or not isinstance(event, LogLine) or event.component.startswith(_CLIPS_COMPONENT)
        )

    def _add_write(self, event: InterfaceWrite) -> None:
        self.first_writes.setdefault(event.uid, event)
        interface_type, _, interface_id = event.uid.partition("::")
        if interface_type == SKILLER:
            self.skillers.setdefault(interface_id, []).append(event)
        elif interface_type == EXECUTOR:
            self.executors.setdefault(interface_id, []).append(event)

    def _add_goal(self, event: GoalTransition) -> None:
        self.has_goals = True
        key = (event.env, event.goal)
        if event.parent == NO_PARENT:
            self._root_modes[key] = event.mode
        else:
            self._root_modes.pop(key, None)


def scan_recording(run: Run) -> Scan:
    """Read the events and the metadata of a recording.

    :raises TraceError: if the recording cannot be read or has nothing to replay.
    """
    scan = Scan(run)
    for event in run:
        scan.add_event(event)
    scan.metadata = dict(run.metadata())
    if run.start_us is not None and scan.is_timed:
        scan.begin_us = run.start_us
    if not scan.transition_count and not scan.first_writes:
        raise TraceError(
            "it holds nothing to replay", file=run.path, hint="neither interface writes nor transitions"
        )
    return scan
