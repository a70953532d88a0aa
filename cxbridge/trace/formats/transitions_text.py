"""Reader and writer of transitions as lines of text, the output of ``trace transitions``.

The environment ``executive`` and the Skiller ``Skiller`` are omitted, as in the recordings of Fawkes. A
golden run, with which a test compares later runs, also has lines with times, and lines with changed details
that are indented below a transition.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from msgspec.structs import replace

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import TraceError
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event, GoalTransition, PlanActionTransition, SkillStatus
from cxbridge.history.transitions import TRANSITION_TYPES, Transition
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.printing import escape_record, unescape_record
from cxbridge.trace.formats.base import CopyFormat, Format, Run, StreamWriter
from cxbridge.trace.formats.files import read_lines, writing

DEFAULT_ENV = "executive"
"""The environment of lines without an environment."""

DEFAULT_SKILLER = "Skiller"
"""The Skiller of lines without the name of a Skiller."""

_GOAL_LINE = re.compile(
    r"goal (\S+) class=(\S+) sub-type=(\S+) parent=(\S+) mode=(\S+) outcome=(\S+) error=(.*)", re.DOTALL
)
_ACTION_LINE = re.compile(r"plan-action (\S+) goal=(\S+) plan=(\S+) action=(\S+) state=(\S+)")
# A possessive quantifier of the group (`*+`) would be faster, but Python 3.11.2 finds no match with it.
_SKILL_LINE = re.compile(
    r'SkillerInterface(?:::((?:(?! skill=").)*))? skill="(.*)" msgid=(\d{1,18}) status=(\S+)', re.DOTALL
)
_ENVIRONMENT_PREFIX = re.compile(r"\[([^]\n]*)\] (.*)", re.DOTALL)
# 12 digits of seconds, with 6 of microseconds, fit into 64 bits.
_TIME_LINE = re.compile(r"at (\d{1,12}\.\d{6})")
_DETAIL_LINE = re.compile(r"  ([a-z][\w-]*)=(.*)", re.DOTALL)
_FIRST_LINES = re.compile(
    rb"^(at \d+\.\d{6}\n)?(\[[^]\n]*\] )?"
    rb"(goal \S+ class=\S+ sub-type=|plan-action \S+ goal=\S+ plan=|SkillerInterface(::[^\n]*)? skill=\")"
)

DEFAULT_DETAILS: Final = {"params": "()", "meta": "()", "priority": "0.0", "resources": "()"}
"""The values of details before the first line that shows them."""


def format_transition(event: Transition) -> str:
    """Return the transition as one line of text, without line feeds and control characters."""
    return escape_record(_format_line(event))


def _format_line(event: Transition) -> str:
    env = "" if event.env == DEFAULT_ENV else f"[{event.env}] "
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
    skiller = env + "SkillerInterface" + ("" if event.skiller == DEFAULT_SKILLER else f"::{event.skiller}")
    return f'{skiller} skill="{event.skill_string}" msgid={event.msgid} status={event.status}'


def parse_transition(line: str, time_us: int = 0) -> Transition | None:
    """Return the transition in a line of text; None for other lines.

    :param time_us: the time of the transition, which its line does not have.
    """
    env, line = DEFAULT_ENV, unescape_record(line)
    if match := _ENVIRONMENT_PREFIX.fullmatch(line):
        env, line = match.groups()
    if match := _GOAL_LINE.fullmatch(line):
        goal, goal_class, sub_type, parent, mode, outcome, error = match.groups()
        return GoalTransition(time_us, env, goal, goal_class, sub_type, parent, mode, outcome, error)
    if match := _ACTION_LINE.fullmatch(line):
        action_id, goal, plan, action, state = match.groups()
        return PlanActionTransition(time_us, env, action_id, goal, plan, action, state)
    if match := _SKILL_LINE.fullmatch(line):
        skiller, skill, msgid, status = match.groups()
        return SkillStatus(time_us, env, skiller or DEFAULT_SKILLER, skill, int(msgid), status)
    return None


class TransitionsText(Run):
    """A file of transitions; without times, line numbers replace microseconds."""

    format = "transitions"
    is_timed = False

    def __iter__(self) -> Iterator[Event]:
        """Yield a transition per line, with details if there are any.

        A truncated last line is left out unless it reads as a transition.

        :raises TraceError: if the file cannot be read, or has an invalid line.
        """
        details = _LastDetails()
        pending_transition: Transition | None = None
        stated_time_us: int | None = None
        for number, line, is_complete in read_lines(self.path):
            event = parse_transition(line, number if stated_time_us is None else stated_time_us)
            if event is not None:
                # the details of a transition follow its line, up to the next transition
                if pending_transition is not None:
                    yield details.complete(pending_transition)
                pending_transition = event
            elif not is_complete:
                self.note(f"line {number}: the file ends within this line")
            # a time applies to all transitions up to the next time
            elif match := _TIME_LINE.fullmatch(line):
                stated_time_us = round(float(match.group(1)) * MICROSECONDS)
            elif pending_transition is not None and (match := _DETAIL_LINE.fullmatch(unescape_record(line))):
                details.store(pending_transition, match.group(1), match.group(2))
            elif line.strip():
                raise TraceError(
                    "this line is not a transition",
                    file=self.path,
                    line=number,
                    hint="a line starts with goal, plan-action or SkillerInterface; see docs/formats.md",
                )
        if pending_transition is not None:
            yield details.complete(pending_transition)

    def has_times(self) -> bool:
        """Return whether the file has times, according to its first line."""
        first_line = next((line for _, line, _ in read_lines(self.path)), "")
        return _TIME_LINE.fullmatch(first_line) is not None


class _LastDetails:
    """The last known details of each goal and plan-action."""

    def __init__(self) -> None:
        self._details_by_subject: dict[tuple[str, ...], dict[str, str]] = {}

    @staticmethod
    def _subject(event: Event) -> tuple[str, ...]:
        """Return the kind of an event and the fields that identify its goal or plan-action."""
        return (event.KIND.name, *(getattr(event, name) for name in event.KIND.subject_fields))

    def store(self, event: Event, name: str, value: str) -> None:
        """Store a changed detail."""
        self._details_by_subject.setdefault(
            self._subject(event), {name: DEFAULT_DETAILS[name] for name in event.KIND.detail_fields}
        )[name] = value

    def complete(self, event: Transition) -> Transition:
        """Return an event with the details of its subject."""
        details = self._details_by_subject.get(self._subject(event), {})
        fields: dict[str, Any] = {name: details[name] for name in event.KIND.detail_fields if name in details}
        if isinstance(event, GoalTransition):
            fields["slots"] = {name: value for name, value in details.items() if value and name not in fields}
        return replace(event, **fields) if details else event

    def changed_lines(self, event: Event) -> Iterator[str]:
        """Yield a line for each changed detail of an event, and store the details; none without details."""
        details = {name: getattr(event, name) or DEFAULT_DETAILS[name] for name in event.KIND.detail_fields}
        if not any(getattr(event, name) for name in event.KIND.detail_fields):
            return
        details |= event.slots if isinstance(event, GoalTransition) else {}
        subject = self._subject(event)
        # the first transition shows its parameters even if there are none: without a line, a reader would
        # take the details for not recorded
        former_details = self._details_by_subject.get(subject, DEFAULT_DETAILS | {"params": ""})
        self._details_by_subject[subject] = details
        for name in (*details, *(former_details.keys() - details.keys() - DEFAULT_DETAILS.keys())):
            if details.get(name, "") != former_details.get(name, ""):
                yield escape_record(f"  {name}={details.get(name, '')}")


class TransitionsWriter(StreamWriter):
    """Writes the transitions of a run as lines of text.

    :param path: replaced if it exists.
    :param details: whether to write parameters and other details, as in golden runs.
    :param start_us: the start of the run in microseconds, to write times in seconds since then; None omits
        times.
    :raises TraceError: if the file cannot be created.
    """

    def __init__(self, path: str | Path, *, details: bool = False, start_us: int | None = None) -> None:
        path = Path(path)
        self._details = _LastDetails() if details else None
        self._start_us = start_us
        self._last_time_line = ""
        with writing(path):
            # the same bytes on every system: golden files are compared as texts
            super().__init__(path, path.open("w", encoding="utf-8", errors="backslashreplace", newline="\n"))

    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:  # noqa: ARG002 - always the same
        return frozenset(TRANSITION_TYPES)

    def write(self, event: Event) -> None:
        if isinstance(event, TRANSITION_TYPES):
            with writing(self.path):
                self._file.writelines(f"{line}\n" for line in self._make_lines(event))

    def _make_lines(self, event: Transition) -> Iterator[str]:
        """Yield the line of a transition with the lines before and after it."""
        if self._start_us is not None:
            time_line = f"at {(event.time_us - self._start_us) / MICROSECONDS:.6f}"
            if time_line != self._last_time_line:
                self._last_time_line = time_line
                yield time_line
        yield format_transition(event)
        if self._details is not None:
            yield from self._details.changed_lines(event)


def open_copy(path: Path, _registry: InterfaceRegistry) -> TransitionsWriter:
    """Open a file for a copy of a run."""
    return TransitionsWriter(path)


FORMATS = (
    Format(
        "transitions",
        rank=60,
        recognises=lambda _, head: _FIRST_LINES.match(head) is not None,
        reader=f"{__name__}:TransitionsText",
    ),
)
COPIES = (CopyFormat("transitions", rank=30, writer=f"{__name__}:open_copy"),)
