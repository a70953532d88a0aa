"""Reads and writes transitions as text, one a line: what ``trace transitions`` prints.

The environment ``executive`` and the skiller ``Skiller`` go without saying, as in the recordings of Fawkes;
others are named.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from cxbridge.errors import TraceError
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event, GoalTransition, PlanActionTransition, SkillStatus
from cxbridge.history.transitions import TRANSITION_TYPES, Transition
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.printing import from_record, to_record
from cxbridge.trace.formats.base import CopyFormat, Format, Run, StreamWriter
from cxbridge.trace.formats.files import read_lines, writing

ENV = "executive"
"""The environment of the lines that name none."""

SKILLER = "Skiller"
"""The skiller of the lines that name none."""

_GOAL = re.compile(
    r"goal (\S+) class=(\S+) sub-type=(\S+) parent=(\S+) mode=(\S+) outcome=(\S+) error=(.*)", re.DOTALL
)
_ACTION = re.compile(r"plan-action (\S+) goal=(\S+) plan=(\S+) action=(\S+) state=(\S+)")
_SKILL = re.compile(r'SkillerInterface(?:::(.*?))? skill="(.*)" msgid=(\d+) status=(\S+)', re.DOTALL)
_ENV = re.compile(r"\[([^]\n]*)\] (.*)", re.DOTALL)
_HEAD = re.compile(
    rb"^(\[[^]\n]*\] )?"
    rb"(goal \S+ class=\S+ sub-type=|plan-action \S+ goal=\S+ plan=|SkillerInterface(::[^\n]*)? skill=\")"
)


def format_transition(event: Transition) -> str:
    """Return the transition as one line of text, without a line feed; no terminal obeys what is in it."""
    return to_record(_line(event))


def _line(event: Transition) -> str:
    env = "" if event.env == ENV else f"[{event.env}] "
    if isinstance(event, GoalTransition):
        return (
            f"{env}goal {event.goal} class={event.goal_class} sub-type={event.sub_type} parent={event.parent}"
            f" mode={event.mode} outcome={event.outcome} error={event.error}"
        )
    if isinstance(event, PlanActionTransition):
        return (
            f"{env}plan-action {event.action_id} goal={event.goal} plan={event.plan}"
            f" action={event.action} state={event.state}"
        )
    skiller = env + "SkillerInterface" + ("" if event.skiller == SKILLER else f"::{event.skiller}")
    return f'{skiller} skill="{event.skill_string}" msgid={event.msgid} status={event.status}'


def parse_transition(line: str, time_us: int = 0) -> Transition | None:
    """Return the transition in a line, None when it has none."""
    env, line = ENV, from_record(line)
    if match := _ENV.fullmatch(line):
        env, line = match.groups()
    if match := _GOAL.fullmatch(line):
        goal, goal_class, sub_type, parent, mode, outcome, error = match.groups()
        return GoalTransition(time_us, env, goal, goal_class, sub_type, parent, mode, outcome, error)
    if match := _ACTION.fullmatch(line):
        action_id, goal, plan, action, state = match.groups()
        return PlanActionTransition(time_us, env, action_id, goal, plan, action, state)
    if match := _SKILL.fullmatch(line):
        skiller, skill, msgid, status = match.groups()
        return SkillStatus(time_us, env, skiller or SKILLER, skill, int(msgid), status)
    return None


class TransitionsText(Run):
    """A file of transitions as text. It knows no times: line numbers stand for microseconds."""

    format = "transitions"

    def __iter__(self) -> Iterator[Event]:
        """Yield one transition a line.

        :raises TraceError: for a line that is none; a cut-off last line is left out.
        """
        for number, line, whole in read_lines(self.path):
            event = parse_transition(line, number)
            if event is not None:
                yield event
            elif not whole:
                self.note(f"line {number}: the file ends within this line")
            elif line.strip():
                raise TraceError(
                    "this line is not a transition",
                    file=self.path,
                    line=number,
                    hint="a line starts with goal, plan-action or SkillerInterface; see docs/formats.md",
                )


class TransitionsWriter(StreamWriter):
    """Writes the transitions of a run as text, one a line.

    :param path: the file; one that is there is replaced.
    :raises TraceError: when the file cannot be made.
    """

    def __init__(self, path: str | Path) -> None:
        path = Path(path)
        with writing(path):
            super().__init__(path, path.open("w", encoding="utf-8", errors="backslashreplace", newline="\n"))

    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:  # noqa: ARG002 - always the same
        """Return the types of transitions."""
        return frozenset(TRANSITION_TYPES)

    def write(self, event: Event) -> None:
        """Write one line."""
        if isinstance(event, TRANSITION_TYPES):
            with writing(self.path):
                self._file.write(format_transition(event) + "\n")


def open_copy(path: Path, _registry: InterfaceRegistry) -> TransitionsWriter:
    """Open a file for a copy of a run."""
    return TransitionsWriter(path)


FORMATS = (
    Format(
        "transitions",
        60,
        recognises=lambda _, head: _HEAD.match(head) is not None,
        reader=f"{__name__}:TransitionsText",
    ),
)
COPIES = (CopyFormat("transitions", 30, f"{__name__}:open_copy"),)
