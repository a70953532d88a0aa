"""Skills that are actions and services of ROS 2, by configuration alone (docs/ros2.md).

A skill is a generator: each step polls the node, and yields the progress if the server has sent some.
"""

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
from cxbridge_ros2.executor import TIMEOUT_S, RosExecutor, seconds_of
from cxbridge_ros2.messages import Message, value_at
from cxbridge_ros2.names import check_topic, parse_type
from cxbridge_ros2.node import Client
from cxbridge_ros2.settings import NodeSettings, check_keys, nested

PATIENCE_S: Final = 5.0  # default limit in seconds without a server until a skill fails

_ACTION_KEYS: Final = ("action", "name", "goal", "feedback", "error", "timeout", "patience")
_SERVICE_KEYS: Final = ("service", "name", "request", "success", "error", "timeout", "patience")
_PARAMETER: Final = re.compile(r"\$(?:([A-Za-z_]\w*)|\{([A-Za-z_]\w*)\})")


class RosSkill(Struct, frozen=True):
    """The configuration of a skill.

    :param kind: the type of the action or service.
    :param name: the absolute name of the action or service.
    :param message: the goal or request; texts may contain parameters of the skill: ``$place``.
    :param feedback: the field of the feedback to show; empty for the whole feedback.
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
        configured: Mapping[str, Any] = self.setting("skills", {})
        if not configured:
            raise ConfigError(
                "RosSkills has no skills", hint="skills: {goto: {action: TYPE, name: /NAME, goal: {}}}"
            )
        namespace = self.node_settings.namespace
        self._skills = {name: _read_skill(name, settings, namespace) for name, settings in configured.items()}
        self.skills = tuple(self._skills)
        self._clients: dict[str, ActionClient | Client] = {}

    @classmethod
    def skills_with(cls, settings: Mapping[str, Any]) -> tuple[str, ...]:
        skills = nested(settings).get("skills")
        return tuple(skills) if isinstance(skills, Mapping) else ()

    @classmethod
    def mistakes(cls, settings: Mapping[str, Any], folder: Path) -> Iterator[CxbridgeError]:
        node_settings = NodeSettings.of(settings, folder, cls.__name__)
        definitions = node_settings.definitions()
        configured = nested(settings).get("skills")
        for name, value in configured.items() if isinstance(configured, Mapping) else ():
            skill = _read_skill(name, value, node_settings.namespace)
            kind = parse_type(skill.kind, "action" if skill.is_action else "srv")
            response = kind.derived("Result" if skill.is_action else "Response")
            try:
                definitions.fields(response)
            except Ros2Error as error:
                yield _add_skill(name, error)
                continue  # without the type, the paths in it cannot be checked
            for message, path in (
                (kind.derived("Feedback"), skill.feedback),
                (response, skill.success),
                (response, skill.error),
            ):
                try:
                    if path:
                        definitions.check_path(message, path)
                except Ros2Error as error:
                    yield _add_skill(name, error)

    def start(self) -> None:
        """Join the domain and make a client for each skill, so that a wrong type is an error at the start."""
        node = self.join()
        for name, skill in self._skills.items():
            self._clients[name] = (
                ActionClient(node, skill.name, skill.kind)
                if skill.is_action
                else node.client(skill.name, skill.kind)
            )

    def execute(self, call: SkillCall) -> Steps:
        skill, client = self._skills[call.skill], self._clients[call.skill]
        message = fill(skill.message, call, self._tables)
        steps = (
            self._achieve(skill, client, message)
            if isinstance(client, ActionClient)
            else self._call(skill, client, message)
        )
        yield from self.limit_time(skill.timeout_s, skill.name, steps)

    def _wait_for_server(self, skill: RosSkill, client: ActionClient | Client) -> Generator[None, None, None]:
        start_us = self.clock.now_us()
        while not client.is_served:
            if self.clock.now_us() - start_us > skill.patience_s * MICROSECONDS:
                reason = client.why_unserved()
                raise SkillFailedError(
                    f"{skill.name} ({skill.kind}) has no server{f': {reason}' if reason else ''}"
                )
            self.poll()
            yield

    def _achieve(self, skill: RosSkill, client: ActionClient, goal: Message) -> Generator[Any, None, None]:
        yield from self._wait_for_server(skill, client)
        sent = client.send(goal)
        try:
            yield from self._follow(skill, client, sent)
        finally:
            if not sent.is_over:
                sent.cancel()  # the skill was cancelled, or has exceeded its time limit
                client.forget(sent)
        if sent.is_accepted is False:
            raise SkillFailedError(f"{skill.name} has rejected the goal")
        if sent.status is GoalStatus.UNKNOWN:
            raise SkillFailedError(f"the server of {skill.name} does not know the goal: it was restarted")
        if sent.status is not GoalStatus.SUCCEEDED:
            reason = sent.reason or value_at(sent.result, skill.error)
            raise SkillFailedError(f"{skill.name}: {sent.status.name}{f', {reason}' if reason else ''}")

    def _follow(self, skill: RosSkill, client: ActionClient, sent: SentGoal) -> Generator[Any, None, None]:
        """Yield the progress of a goal until its end."""
        served_us, reported, highest = self.clock.now_us(), None, 0.0
        while True:
            self.poll()
            if sent.is_over:
                return
            now_us = self.clock.now_us()
            client.check_server(sent)
            if client.is_served:
                served_us = now_us
            elif now_us - served_us > skill.patience_s * MICROSECONDS:
                raise SkillFailedError(f"the server of {skill.name} has vanished")
            if sent.feedback is None or sent.feedback is reported:
                yield None
                continue
            reported = sent.feedback
            value = value_at(reported, skill.feedback) if skill.feedback else reported
            number = value if isinstance(value, int | float) and math.isfinite(value) else 0.0
            highest = max(highest, number)
            # the number is a remaining amount, such as a distance, which falls to zero; replanning may raise
            # it
            progress = 1 - number / highest if highest > 0 else 0.0
            yield Progress(progress, f"{skill.feedback} {value}".strip())

    def _call(self, skill: RosSkill, client: Client, request: Message) -> Generator[Any, None, None]:
        yield from self._wait_for_server(skill, client)
        responses: list[Message] = []
        reasons: list[str] = []
        number = client.call(request, responses.append, reasons.append)
        try:
            while True:
                self.poll()
                if reasons:
                    raise SkillFailedError(f"{skill.name}: {reasons[0]}")
                if responses:
                    break
                yield None
        finally:
            client.forget(number)  # a later response has no receiver
        if skill.success and value_at(responses[0], skill.success) is not True:
            reason = value_at(responses[0], skill.error)
            raise SkillFailedError(f"{skill.name}: {reason or f'{skill.success} is not true'}")


def _add_skill(name: str, error: Ros2Error) -> Ros2Error:
    """Add the name of a skill to an error."""
    error.message = f"the skill {name}: {error.message}"
    return error


def fill(value: Any, call: SkillCall, tables: Mapping[str, Mapping[str, Any]]) -> Any:
    """Return a message with the parameters of a call inserted.

    ``$place`` alone becomes the parameter's value with its type, or its entry in the table of that name.
    Within a longer text it becomes text.

    :raises SkillError: if the call lacks a parameter, or a table an entry.
    """
    if isinstance(value, Mapping):
        return {key: fill(inner, call, tables) for key, inner in value.items()}
    if isinstance(value, list):
        return [fill(inner, call, tables) for inner in value]
    if not isinstance(value, str):
        return value
    match = _PARAMETER.fullmatch(value)
    if match is None:
        return _PARAMETER.sub(lambda inner: str(call.get(inner[1] or inner[2])), value)
    name = match[1] or match[2]
    argument = call.get(name)
    if name not in tables:
        return argument
    try:
        # arguments may be numbers, and the keys of a table are texts
        return tables[name][str(argument)]
    except KeyError:
        raise SkillError(
            f"the table '{name}' has no entry '{argument}'",
            hint=did_you_mean(str(argument), tables[name], f"it has: {', '.join(tables[name])}"),
        ) from None


def _read_skill(name: str, settings: Any, namespace: str) -> RosSkill:
    if not isinstance(settings, Mapping) or ("action" in settings) == ("service" in settings):
        raise ConfigError(
            f"the skill {name} is neither an action nor a service", hint="name one: action: TYPE"
        )
    is_action = "action" in settings
    check_keys(settings, _ACTION_KEYS if is_action else _SERVICE_KEYS, f"the skill {name}")
    message = settings.get("goal" if is_action else "request", {})
    if not isinstance(message, Mapping) and not _PARAMETER.fullmatch(str(message)):
        raise ConfigError(
            f"the goal or request of the skill {name} is a mapping, not {message!r}",
            hint="or a parameter that is one in a table: $place",
        )
    return RosSkill(
        kind=str(settings["action" if is_action else "service"]),
        is_action=is_action,
        name=check_topic(f"{namespace}{settings.get('name', '')}"),
        message=message,
        feedback=str(settings.get("feedback", "")),
        success=str(settings.get("success", "")),
        error=str(settings.get("error", "")),
        timeout_s=seconds_of(name, "timeout", settings.get("timeout", TIMEOUT_S)),
        patience_s=seconds_of(name, "patience", settings.get("patience", PATIENCE_S)),
    )
