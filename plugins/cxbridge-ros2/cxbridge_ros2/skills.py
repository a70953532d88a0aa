"""Skills that are actions and services of ROS 2, by configuration alone (docs/ros2.md)."""

from __future__ import annotations

import math
import re
from collections.abc import Generator, Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar, Final

from msgspec import Struct

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import ConfigError, CxbridgeError, Ros2Error, SkillError
from cxbridge.skiller.board import Progress, SkillCall, SkillFailedError, Steps
from cxbridge.skiller.board.executor import ExecutorContext
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.actions import ActionClient, GoalStatus, SentGoal
from cxbridge_ros2.executor import TIMEOUT_S, NodeSettings, RosExecutor, nested, seconds_of
from cxbridge_ros2.messages import Message
from cxbridge_ros2.names import parse_type
from cxbridge_ros2.node import Client
from cxbridge_ros2.topics import check_topic

PATIENCE_S: Final = 5.0  # default limit in seconds without a server until a skill fails

_OF_ACTION: Final = ("action", "name", "goal", "feedback", "error", "timeout", "patience")
_OF_SERVICE: Final = ("service", "name", "request", "success", "error", "timeout", "patience")
_PARAMETER: Final = re.compile(r"\$(?:([A-Za-z_]\w*)|\{([A-Za-z_]\w*)\})")


class RosSkill(Struct, frozen=True):
    """The configuration of a skill.

    :param kind: the type of the action or service.
    :param name: the absolute name of the action or service.
    :param message: the goal or request; texts may contain parameters of the skill: ``$place``.
    :param feedback: the field of the feedback to show; empty for all of it.
    :param success: the field of a response that must be true; empty if any response is a success.
    :param error: the field of a result or response with the error; may be empty.
    """

    kind: str
    is_action: bool
    name: str
    message: Mapping[str, Any] | str
    feedback: str
    success: str
    error: str
    timeout_s: float
    patience_s: float


class RosSkills(RosExecutor):
    """Executes skills as actions and services of ROS 2 nodes."""

    known_settings: ClassVar[tuple[str, ...]] = (*RosExecutor.known_settings, "tables")

    def __init__(self, context: ExecutorContext) -> None:
        super().__init__(context)
        self._tables: Mapping[str, Mapping[str, Any]] = self.setting("tables", {})
        self._known = {
            name: _skill(name, value, self.node_settings.namespace)
            for name, value in self._configured().items()
        }
        self.skills = tuple(self._known)
        self._clients: dict[str, ActionClient | Client] = {}

    @classmethod
    def skills_with(cls, settings: Mapping[str, Any]) -> tuple[str, ...]:
        skills = nested(settings).get("skills")
        return tuple(skills) if isinstance(skills, Mapping) else ()

    @classmethod
    def mistakes(cls, settings: Mapping[str, Any], folder: Path) -> Iterator[CxbridgeError]:
        nodes = NodeSettings.of(settings, folder, cls.__name__)
        definitions = nodes.definitions()
        configured = nested(settings).get("skills")
        for skill, value in configured.items() if isinstance(configured, Mapping) else ():
            known = _skill(skill, value, nodes.namespace)
            kind = parse_type(known.kind, "action" if known.is_action else "srv")
            answer = kind.derived("Result" if known.is_action else "Response")
            paths = (
                (kind.derived("Feedback"), known.feedback),
                (answer, known.success),
                (answer, known.error),
            )
            try:
                for message, path in paths:
                    lacks = definitions.lacking(message, path) if path else None
                    if lacks is not None:
                        hint = did_you_mean(lacks[0], lacks[1], f"it has: {', '.join(lacks[1])}")
                        yield ConfigError(f"the skill {skill}: {message} has no field '{path}'", hint=hint)
                definitions.fields(answer)
            except Ros2Error as error:
                error.message = f"the skill {skill}: {error.message}"
                yield error

    def _configured(self) -> Mapping[str, Any]:
        skills: Mapping[str, Any] = self.setting("skills", {})
        if not skills:
            raise ConfigError(
                "RosSkills has no skills", hint="skills: {goto: {action: TYPE, name: /NAME, goal: {}}}"
            )
        return skills

    def start(self) -> None:
        """Join the domain and make a client for each skill, so that a wrong type is an error at the start."""
        node = self.join()
        for skill, known in self._known.items():
            self._clients[skill] = (
                ActionClient(node, known.name, known.kind)
                if known.is_action
                else node.client(known.name, known.kind)
            )

    def execute(self, call: SkillCall) -> Steps:
        known, client = self._known[call.skill], self._clients[call.skill]
        message = fill(known.message, call, self._tables)
        steps = (
            self._act(known, client, message)
            if isinstance(client, ActionClient)
            else self._ask(known, client, message)
        )
        yield from self.within(known.timeout_s, known.name, steps)

    def _served(self, known: RosSkill, client: ActionClient | Client) -> Generator[None, None, None]:
        since_us = self.clock.now_us()
        while not client.is_served:
            if self.clock.now_us() - since_us > known.patience_s * MICROSECONDS:
                why = client.why_unserved()
                raise SkillFailedError(
                    f"{known.name} ({known.kind}) has no server{f': {why}' if why else ''}"
                )
            self.poll()
            yield

    def _act(self, known: RosSkill, client: ActionClient, goal: Message) -> Generator[Any, None, Any]:
        yield from self._served(known, client)
        sent = client.send(goal)
        try:
            yield from self._follow(known, client, sent)
        finally:
            if not sent.is_over:
                sent.cancel()  # the skill was cancelled, or has exceeded its time
                client.forget(sent)
        if sent.is_accepted is False:
            raise SkillFailedError(f"{known.name} has rejected the goal")
        if sent.status is GoalStatus.UNKNOWN:
            raise SkillFailedError(f"the server of {known.name} does not know the goal: it was restarted")
        if sent.status is not GoalStatus.SUCCEEDED:
            reason = sent.reason or _field(sent.result or {}, known.error)
            raise SkillFailedError(f"{known.name}: {sent.status.name}{f', {reason}' if reason else ''}")

    def _follow(self, known: RosSkill, client: ActionClient, sent: SentGoal) -> Generator[Any, None, None]:
        seen_us, reported, first = self.clock.now_us(), None, 0.0
        while True:
            self.poll()
            if sent.is_over:
                return
            now_us = self.clock.now_us()
            client.look(sent)
            if client.is_served:
                seen_us = now_us
            elif now_us - seen_us > known.patience_s * MICROSECONDS:
                raise SkillFailedError(f"the server of {known.name} has vanished")
            if sent.feedback is None or sent.feedback is reported:
                yield None
                continue
            reported = sent.feedback
            value = _field(reported, known.feedback) if known.feedback else reported
            number = value if isinstance(value, int | float) and math.isfinite(value) else 0.0
            first = max(first, number)
            # a remaining amount, such as a distance, falls to zero
            yield Progress(1 - number / first if first > 0 else 0.0, f"{known.feedback} {value}".strip())

    def _ask(self, known: RosSkill, client: Client, request: Message) -> Generator[Any, None, Any]:
        yield from self._served(known, client)
        answers: list[Message] = []
        reasons: list[str] = []
        number = client.call(request, answers.append, reasons.append)
        try:
            while not answers:
                self.poll()
                if reasons:
                    raise SkillFailedError(f"{known.name}: {reasons[0]}")
                if not answers:
                    yield None
        finally:
            client.forget(number)
        if known.success and _field(answers[0], known.success) is not True:
            reason = _field(answers[0], known.error)
            raise SkillFailedError(f"{known.name}: {reason or f'{known.success} is not true'}")


def fill(value: Any, call: SkillCall, tables: Mapping[str, Mapping[str, Any]]) -> Any:
    """Return a message with the parameters of a call inserted.

    ``$place`` alone becomes the parameter's value with its type, or its entry in the table of that name.
    Within a longer text it becomes text.

    :raises SkillError: if the call lacks a parameter, or a table an entry.
    """
    if isinstance(value, Mapping):
        return {key: fill(each, call, tables) for key, each in value.items()}
    if isinstance(value, list):
        return [fill(each, call, tables) for each in value]
    if not isinstance(value, str):
        return value
    whole = _PARAMETER.fullmatch(value)
    if whole is None:
        return _PARAMETER.sub(lambda each: str(call.get(each[1] or each[2])), value)
    name = whole[1] or whole[2]
    argument = call.get(name)
    if name not in tables:
        return argument
    try:
        return tables[name][str(argument)]
    except KeyError:
        hint = did_you_mean(str(argument), tables[name], f"it has: {', '.join(tables[name])}")
        raise SkillError(f"the table '{name}' has no entry '{argument}'", hint=hint) from None


def _skill(name: str, value: Any, namespace: str) -> RosSkill:
    if not isinstance(value, Mapping) or ("action" in value) == ("service" in value):
        raise ConfigError(
            f"the skill {name} is neither an action nor a service", hint="name one: action: TYPE"
        )
    is_action = "action" in value
    known = _OF_ACTION if is_action else _OF_SERVICE
    for key in value:
        if key not in known:
            raise ConfigError(f"the skill {name} has no setting '{key}'", hint=f"it has: {', '.join(known)}")
    message = value.get("goal" if is_action else "request", {})
    if not isinstance(message, Mapping) and not _PARAMETER.fullmatch(str(message)):
        hint = "or a parameter that is one in a table: $place"
        raise ConfigError(f"the goal or request of the skill {name} is a mapping, not {message!r}", hint=hint)
    return RosSkill(
        kind=str(value["action" if is_action else "service"]),
        is_action=is_action,
        name=check_topic(f"{namespace}{value.get('name', '')}"),
        message=message,
        feedback=str(value.get("feedback", "")),
        success=str(value.get("success", "")),
        error=str(value.get("error", "")),
        timeout_s=seconds_of(name, "timeout", value.get("timeout", TIMEOUT_S)),
        patience_s=seconds_of(name, "patience", value.get("patience", PATIENCE_S)),
    )


def _field(message: Any, path: str) -> Any:
    for part in path.split(".") if path else ():
        if not isinstance(message, Mapping) or part not in message:
            return None
        message = message[part]
    return message if path else None
