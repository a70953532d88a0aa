"""Recorded behaviour of Skillers and executors, command by command."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Final

from cxbridge.errors import SkillError
from cxbridge.events import InterfaceMessage, InterfaceWrite, SkillStatus
from cxbridge.history.exchange import read_progress
from cxbridge.skiller.board.protocol import decode_parameters
from cxbridge.trace.compare.names import replace_names

Values = Mapping[str, Any]
"""The values of an interface or a message, by field name."""

_END_STATUSES: Final = ("S_FINAL", "S_FAILED")
_IDLE_VALUES: Final = {
    "skill_string": "",
    "error": "",
    "exclusive_controller": "",
    "msgid": 0,
    "status": "S_INACTIVE",
}
_BUSY: Final = "BUSY"
_CANCELLED: Final = "CANCELLED"


class CommandKind(Enum):
    """A command to a Skiller; the values are display names."""

    EXEC = "ExecSkill"
    STOP = "StopExec"
    CONTROL = "AcquireControl"


@dataclass(slots=True)
class Command:
    """A command to a Skiller, with the resulting writes.

    :param text: the skill string of the first write; empty for a :attr:`CommandKind.STOP`.
    :param time_us: the time of the first write.
    :param values: the values of the first write.
    :param later_writes: further writes: the microseconds after the first write, and the values.
    """

    kind: CommandKind
    text: str
    time_us: int
    values: Values
    later_writes: list[tuple[int, Values]] = field(default_factory=list)

    def is_for(self, kind: CommandKind, text: str) -> bool:
        """Return whether a command of the run has this kind and text, ignoring gensym ids and UUIDs."""
        return self.kind is kind and replace_names(self.text) == replace_names(text)

    def __str__(self) -> str:
        return f"{self.kind.value} '{self.text}'" if self.kind is CommandKind.EXEC else self.kind.value


@dataclass(slots=True)
class SkillerScript:
    """The recorded commands of a Skiller.

    :ivar initial_writes: the writes before the first command: the time in microseconds, and the values.
    """

    initial_writes: list[tuple[int, Values]] = field(default_factory=list)
    commands: list[Command] = field(default_factory=list)


def make_skiller_script(writes: Iterable[InterfaceWrite]) -> SkillerScript:
    """Split the writes of a SkillerInterface into commands, by the rules in docs/recording.md."""
    script = SkillerScript()
    previous: Values = _IDLE_VALUES
    current: Command | None = None
    for number, write in enumerate(writes):
        values = {**_IDLE_VALUES, **write.values}
        kind = _find_command_kind(previous, values, is_first=not number)
        if kind is not None:
            command = Command(kind, values["skill_string"], write.time_us, values)
            script.commands.append(command)
            if kind is not CommandKind.CONTROL:
                current = command
        elif values["exclusive_controller"] != previous["exclusive_controller"]:
            pass  # the end of control: the run's own ReleaseControl causes the same write
        elif current is not None:
            current.later_writes.append((write.time_us - current.time_us, values))
        else:
            script.initial_writes.append((write.time_us, values))
        previous = values
    return script


def _find_command_kind(previous: Values, values: Values, *, is_first: bool) -> CommandKind | None:
    """Return the kind of the command that caused a write.

    None if the Skiller wrote by itself or lost its controller.
    """
    skill_string, controller = values["skill_string"], values["exclusive_controller"]
    has_new_controller = bool(controller) and controller != previous["exclusive_controller"]
    is_leftover = is_first and values["status"] in _END_STATUSES  # state of a skill from before the recording
    if skill_string and values["msgid"] and not is_leftover:
        # each sender numbers its own messages: two commands of the same skill may have the same id
        is_restarted = values["status"] == "S_RUNNING" and previous["status"] in _END_STATUSES
        if values["msgid"] != previous["msgid"] or skill_string != previous["skill_string"] or is_restarted:
            return CommandKind.EXEC
    if not skill_string and previous["skill_string"]:
        return CommandKind.STOP
    return CommandKind.CONTROL if has_new_controller else None


def reconstruct_writes(skiller: str, statuses: Iterable[SkillStatus]) -> list[InterfaceWrite]:
    """Reconstruct the writes of a Skiller from its statuses. Error texts are lost."""
    # statuses name no controller: the reader that they come from is taken to have control all the time
    return [
        InterfaceWrite(
            skill_status.time_us,
            f"SkillerInterface::{skiller}",
            {
                **_IDLE_VALUES,
                "skill_string": skill_status.skill_string,
                "exclusive_controller": "the reader",
                "msgid": skill_status.msgid,
                "status": skill_status.status,
            },
        )
        for skill_status in statuses
    ]


@dataclass(slots=True)
class RecordedExecution:
    """A recorded skill execution.

    :param parameters: the parameters by name; None if they are not recorded.
    :param time_us: the time of the start.
    :param duration_us: the duration; None if the recording ends before the execution.
    :param feedback: the messages: microseconds after the start, progress, and text.
    :param outcome: the outcome, e.g. SUCCEEDED, FAILED or CANCELLED; SUCCEEDED if it is not recorded.
    """

    skill: str
    time_us: int
    parameters: Mapping[str, Any] | None = None
    duration_us: int | None = None
    feedback: list[tuple[int, float, str]] = field(default_factory=list)
    outcome: str = "SUCCEEDED"
    error: str = ""

    @property
    def ends_itself(self) -> bool:
        """Whether the execution ends without being cancelled."""
        return self.duration_us is not None and self.outcome != _CANCELLED

    def __str__(self) -> str:
        return format_call(self.skill, self.parameters)


@dataclass(slots=True)
class ExecutorScript:
    """The recorded behaviour of an executor.

    :param name: the id of its SkillExecutorInterface.
    :param agent: the agent whose skills it executes.
    """

    name: str
    agent: str
    skills: tuple[str, ...]
    executions: list[RecordedExecution] = field(default_factory=list)


def format_call(skill: str, parameters: Mapping[str, Any] | None) -> str:
    """Return a skill call as text for messages: the skill, with its parameters as JSON if they are known."""
    return skill if parameters is None else f"{skill} {json.dumps(dict(parameters), ensure_ascii=False)}"


def make_executor_script(
    name: str, writes: Sequence[InterfaceWrite], messages: Iterable[InterfaceMessage]
) -> ExecutorScript:
    """Return an executor's behaviour, from the writes of its interface and the recorded messages.

    :param name: the id of the interface.
    :param writes: at least one write, in the order of their times.
    :param messages: messages of all executors.
    """
    first_values = writes[0].values
    script = ExecutorScript(
        name, str(first_values.get("agent", "")), tuple(str(first_values.get("skills", "")).split())
    )
    executions_by_ticket: dict[tuple[Any, Any], RecordedExecution] = {}
    running: RecordedExecution | None = None
    for write in writes:
        is_busy = write.values.get("state") == _BUSY
        if is_busy and running is None:
            running = RecordedExecution(str(write.values.get("skill", "")), write.time_us)
            script.executions.append(running)
            executions_by_ticket[_read_ticket(write.values)] = running
        elif not is_busy and running is not None:
            running.duration_us = write.time_us - running.time_us
            running = None
    uid = f"SkillExecutorInterface::{name}"
    for message in messages:
        if message.uid == uid or message.values.get("executor") == name:
            execution = executions_by_ticket.get(_read_ticket(message.values))
            if execution is not None:
                _add_message(execution, message)
    return script


def _read_ticket(values: Values) -> tuple[Any, Any]:
    """Return the epoch of the board and the number of the master, which identify an execution."""
    return values.get("epoch"), values.get("master")


def _add_message(execution: RecordedExecution, message: InterfaceMessage) -> None:
    values = message.values
    if message.message == "RequestMessage":
        try:
            execution.parameters = decode_parameters(str(values.get("parameters") or ""))
        except SkillError:  # a recording may have any text
            execution.parameters = None
    elif message.message == "FeedbackMessage":
        execution.feedback.append(
            (message.time_us - execution.time_us, read_progress(values), str(values.get("text", "")))
        )
    elif message.message == "FinishMessage":
        execution.outcome, execution.error = str(values.get("outcome", "")), str(values.get("error", ""))
