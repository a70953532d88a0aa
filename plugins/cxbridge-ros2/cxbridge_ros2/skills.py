"""Skills that are actions and services of ROS 2, by configuration alone (docs/ros2.md).

The execution of a skill is a generator. Each step polls the node, and yields the progress if the server has
sent feedback.
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
from cxbridge_ros2.executor import DEFAULT_TIMEOUT_S, RosExecutor, parse_seconds
from cxbridge_ros2.messages import Message, find_value
from cxbridge_ros2.names import check_ros_name, parse_type
from cxbridge_ros2.node import Client
from cxbridge_ros2.settings import NodeSettings, check_keys, nest_settings

DEFAULT_SERVER_TIMEOUT_S: Final = 5.0  # the default time without a server after which a skill fails

_ACTION_KEYS: Final = ("action", "name", "goal", "feedback", "error", "timeout", "patience")
_SERVICE_KEYS: Final = ("service", "name", "request", "success", "error", "timeout", "patience")
_PARAMETER: Final = re.compile(r"\$(?:([A-Za-z_]\w*)|\{([A-Za-z_]\w*)\})")  # $place or ${place}


class RosSkillSettings(Struct, frozen=True):
    """The configuration of a skill. Paths of fields have dots: ``current_pose.header``.

    :param type_name: the type of the action or service.
    :param name: the absolute name of the action or service.
    :param template: the goal or request; texts may contain parameters of the skill: ``$place``.
    :param feedback_path: the field of the feedback to show; empty for the whole feedback.
    :param success_path: the field of a response that must be true; empty if any response is a success.
    :param error_path: the field of a result or response with the error; empty if errors have no text.
    :param timeout_s: the time limit of the skill.
    :param server_timeout_s: the time without a server after which the skill fails.
    """

    type_name: str
    is_action: bool
    name: str
    template: Mapping[str, Any] | str
    feedback_path: str
    success_path: str
    error_path: str
    timeout_s: float
    server_timeout_s: float


class RosSkills(RosExecutor):
    """Executes skills as actions and services of ROS 2 nodes."""

    known_settings: ClassVar[tuple[str, ...]] = (*RosExecutor.known_settings, "tables")

    def __init__(self, context: ExecutorContext) -> None:
        super().__init__(context)
        self._tables: Mapping[str, Mapping[str, Any]] = self.setting("tables", {})
        settings_by_skill: Mapping[str, Any] = self.setting("skills", {})
        if not settings_by_skill:
            raise ConfigError(
                "RosSkills has no skills", hint="skills: {goto: {action: TYPE, name: /NAME, goal: {}}}"
            )
        namespace = self.node_settings.namespace
        self._skills = {
            name: _read_skill(name, settings, namespace) for name, settings in settings_by_skill.items()
        }
        self.skills = tuple(self._skills)
        self._clients: dict[str, ActionClient | Client] = {}

    @classmethod
    def skills_with(cls, settings: Mapping[str, Any]) -> tuple[str, ...]:
        skills = nest_settings(settings).get("skills")
        return tuple(skills) if isinstance(skills, Mapping) else ()

    @classmethod
    def mistakes(cls, settings: Mapping[str, Any], folder: Path) -> Iterator[CxbridgeError]:
        node_settings = NodeSettings.parse(settings, folder, cls.__name__)
        definitions = node_settings.load_definitions()
        settings_by_skill = nest_settings(settings).get("skills")
        for name, skill_settings in (
            settings_by_skill.items() if isinstance(settings_by_skill, Mapping) else ()
        ):
            skill = _read_skill(name, skill_settings, node_settings.namespace)
            ros_type = parse_type(skill.type_name, "action" if skill.is_action else "srv")
            response = ros_type.derive("Result" if skill.is_action else "Response")
            typed_paths = (
                (ros_type.derive("Feedback"), skill.feedback_path),
                (response, skill.success_path),
                (response, skill.error_path),
            )
            try:
                definitions.find_fields(response)
                for message_type, path in typed_paths:
                    if path:
                        definitions.check_path(message_type, path)
            except Ros2Error as error:
                error.message = f"the skill {name}: {error.message}"
                yield error

    def start(self) -> None:
        """Join the domain and make a client for each skill, so that a wrong type is an error at the start."""
        node = self.join()
        for name, skill in self._skills.items():
            self._clients[name] = (
                ActionClient(node, skill.name, skill.type_name)
                if skill.is_action
                else node.create_client(skill.name, skill.type_name)
            )

    def execute(self, call: SkillCall) -> Steps:
        skill, client = self._skills[call.skill], self._clients[call.skill]
        message = fill_template(skill.template, call, self._tables)
        steps = (
            self._achieve_goal(skill, client, message)
            if isinstance(client, ActionClient)
            else self._call_service(skill, client, message)
        )
        yield from self.limit_time(skill.timeout_s, skill.name, steps)

    def _wait_for_server(
        self, skill: RosSkillSettings, client: ActionClient | Client
    ) -> Generator[None, None, None]:
        start_us = self.clock.now_us()
        while not client.has_server:
            if self.clock.now_us() - start_us > skill.server_timeout_s * MICROSECONDS:
                reason = client.explain_missing_server()
                raise SkillFailedError(
                    f"{skill.name} ({skill.type_name}) has no server{f': {reason}' if reason else ''}"
                )
            self.poll()
            yield

    def _achieve_goal(
        self, skill: RosSkillSettings, client: ActionClient, goal: Message
    ) -> Generator[Any, None, None]:
        yield from self._wait_for_server(skill, client)
        sent_goal = client.send(goal)
        try:
            yield from self._yield_progress(skill, client, sent_goal)
        finally:
            if not sent_goal.is_over:
                sent_goal.cancel()  # cancelled skill, exceeded time limit or vanished server
                client.forget(sent_goal)
        if sent_goal.is_accepted is False:
            raise SkillFailedError(f"{skill.name} has rejected the goal")
        if sent_goal.status is GoalStatus.UNKNOWN:
            raise SkillFailedError(
                f"the server of {skill.name} does not know the goal, since it was restarted"
            )
        if sent_goal.status is not GoalStatus.SUCCEEDED:
            reason = sent_goal.reason or find_value(sent_goal.result, skill.error_path)
            raise SkillFailedError(f"{skill.name}: {sent_goal.status.name}{f', {reason}' if reason else ''}")

    def _yield_progress(
        self, skill: RosSkillSettings, client: ActionClient, sent_goal: SentGoal
    ) -> Generator[Any, None, None]:
        """Yield the progress of a goal until its end; None for a step without new feedback."""
        last_served_us, shown_feedback, max_amount = self.clock.now_us(), None, 0.0
        while True:
            self.poll()
            if sent_goal.is_over:
                return
            now_us = self.clock.now_us()
            client.check_server(sent_goal)
            if client.has_server:
                last_served_us = now_us
            elif now_us - last_served_us > skill.server_timeout_s * MICROSECONDS:
                raise SkillFailedError(f"the server of {skill.name} has vanished")
            if sent_goal.feedback is None or sent_goal.feedback is shown_feedback:
                yield None
                continue
            shown_feedback = sent_goal.feedback
            shown_value = (
                find_value(shown_feedback, skill.feedback_path) if skill.feedback_path else shown_feedback
            )
            amount = (
                shown_value if isinstance(shown_value, int | float) and math.isfinite(shown_value) else 0.0
            )
            max_amount = max(max_amount, amount)
            # the amount remains to be done, such as a distance, and falls to zero; a detour may raise the
            # amount above that of the start
            progress = 1 - amount / max_amount if max_amount > 0 else 0.0
            yield Progress(progress, f"{skill.feedback_path} {shown_value}".strip())

    def _call_service(
        self, skill: RosSkillSettings, client: Client, request: Message
    ) -> Generator[Any, None, None]:
        yield from self._wait_for_server(skill, client)
        responses: list[Message] = []
        failure_reasons: list[str] = []
        number = client.call(request, responses.append, failure_reasons.append)
        try:
            while not responses:
                yield None
                self.poll()
                if failure_reasons:
                    raise SkillFailedError(f"{skill.name}: {failure_reasons[0]}")
        finally:
            client.forget(number)  # a later response has no receiver
        if skill.success_path and find_value(responses[0], skill.success_path) is not True:
            reason = find_value(responses[0], skill.error_path)
            raise SkillFailedError(f"{skill.name}: {reason or f'{skill.success_path} is not true'}")


def fill_template(template: Any, call: SkillCall, tables: Mapping[str, Mapping[str, Any]]) -> Any:
    """Return a template with the arguments of a call in place of its parameters.

    A text that is only a parameter, such as ``$place``, becomes the argument, which keeps its type. If a
    table has the name of the parameter, the text becomes the table's entry for the argument. In a longer
    text, the argument is inserted as text.

    :raises SkillError: if the call lacks an argument, or a table an entry.
    """
    if isinstance(template, Mapping):
        return {key: fill_template(element, call, tables) for key, element in template.items()}
    if isinstance(template, list):
        return [fill_template(element, call, tables) for element in template]
    if not isinstance(template, str):
        return template
    match = _PARAMETER.fullmatch(template)
    if match is None:
        return _PARAMETER.sub(lambda match: str(call.get(match[1] or match[2])), template)
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


def _read_skill(name: str, settings: Any, namespace: str) -> RosSkillSettings:
    if not isinstance(settings, Mapping) or ("action" in settings) == ("service" in settings):
        raise ConfigError(
            f"the skill {name} is neither an action nor a service", hint="write action: TYPE or service: TYPE"
        )
    is_action = "action" in settings
    check_keys(settings, _ACTION_KEYS if is_action else _SERVICE_KEYS, f"the skill {name}")
    template = settings.get("goal" if is_action else "request", {})
    if not isinstance(template, Mapping) and not _PARAMETER.fullmatch(str(template)):
        raise ConfigError(
            f"the goal or request of the skill {name} must be a mapping, not {template!r}",
            hint="or a parameter whose table has mappings: $place",
        )
    return RosSkillSettings(
        type_name=str(settings["action" if is_action else "service"]),
        is_action=is_action,
        name=check_ros_name(f"{namespace}{settings.get('name', '')}"),
        template=template,
        feedback_path=str(settings.get("feedback", "")),
        success_path=str(settings.get("success", "")),
        error_path=str(settings.get("error", "")),
        timeout_s=parse_seconds(name, "timeout", settings.get("timeout", DEFAULT_TIMEOUT_S)),
        server_timeout_s=parse_seconds(name, "patience", settings.get("patience", DEFAULT_SERVER_TIMEOUT_S)),
    )
