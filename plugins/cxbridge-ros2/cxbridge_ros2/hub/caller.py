"""The calling side: an executor of the skill board whose skills are executed by performers of a hub.

The caller behaves like those of PlanSys2 and of the thesis, except where these hang. It repeats REQUEST until
a performer responds, confirms one performer, and rejects all further performers, also after the end. A
performer whose RESPONSE was lost would wait forever, so it is rejected. A performer that vanishes or restarts
is a failure.
"""

from __future__ import annotations

import secrets
from collections.abc import Generator, Mapping
from typing import Any, ClassVar, Final

from msgspec import Struct

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import ConfigError, SkillError
from cxbridge.history.exchange import MAPPED_ACTION
from cxbridge.skiller.board import Progress, SkillCall, SkillFailedError, Steps
from cxbridge.skiller.board.executor import ExecutorContext
from cxbridge_ros2.executor import DEFAULT_TIMEOUT_S, RosExecutor, parse_seconds
from cxbridge_ros2.hub.hub import Hub
from cxbridge_ros2.hub.protocol import (
    ActionKey,
    Heartbeat,
    HubMessage,
    HubProtocol,
    MessageKind,
    PerformerState,
)
from cxbridge_ros2.settings import check_keys, nest_settings, to_list
from cxbridge_ros2.skills import fill_template

RETRY_S: Final = 1.0  # seconds between REQUESTs without a response, as in PlanSys2

SILENCE_S: Final = 5.0  # seconds without a heartbeat until a performer counts as gone

_SKILL_KEYS: Final = ("action", "arguments", "mapped", "timeout", "patience")
_MAX_UNANSWERED: Final = 2  # REQUESTs after which a performer that reports READY counts as deaf
_MAX_IDLE_HEARTBEATS: Final = 2  # heartbeats without the confirmed action: the first may be older
_MAX_REQUESTS: Final = 100  # recent REQUESTs whose late RESPONSEs are rejected


class HubSkill(Struct, frozen=True):
    """The configuration of a skill.

    :param action: the name of the action on the hub.
    :param arguments: texts with parameters of the skill; None for all parameters in order.
    :param mapped: the skill string mapped to the action; None for the parameter ``mapped_action``.
    """

    action: str
    arguments: list[Any] | None
    mapped: str | None
    timeout_s: float
    patience_s: float

    @classmethod
    def parse(cls, name: str, settings: Any, protocol: HubProtocol) -> HubSkill:
        """Read the settings of a skill."""
        if not isinstance(settings, Mapping):
            raise ConfigError(f"the skill {name} has settings, not {settings!r}", hint="e.g. {timeout: 60}")
        keys = [key for key in _SKILL_KEYS if key != "mapped" or protocol.has_agents]
        check_keys(settings, keys, f"the skill {name}")
        arguments = settings.get("arguments")
        return cls(
            action=str(settings.get("action", name)),
            arguments=None if arguments is None else to_list(arguments),
            mapped=str(settings["mapped"]) if "mapped" in settings else None,
            timeout_s=parse_seconds(name, "timeout", settings.get("timeout", DEFAULT_TIMEOUT_S)),
            patience_s=parse_seconds(name, "patience", settings.get("patience", protocol.patience_s)),
        )

    def arguments_for(self, call: SkillCall) -> tuple[str, ...]:
        """Return the arguments of the action for a call.

        :raises SkillError: if an argument is a list or a mapping.
        """
        if self.arguments is None:
            values = [value for name, value in call.parameters.items() if name != MAPPED_ACTION]
        else:
            values = [fill_template(argument, call, {}) for argument in self.arguments]
        for value in values:
            if isinstance(value, list | Mapping):
                raise SkillError(f"{call.skill}: {value!r} is no argument of an action")
        return tuple(map(str, values))


class _OpenRequest(Struct):
    """A requested action until its end.

    :ivar performer: the confirmed performer; empty before.
    :ivar feedback: the last FEEDBACK, or None.
    :ivar finish: the FINISH, or None.
    :ivar idle_heartbeats: the number of consecutive heartbeats without the action.
    """

    request: HubMessage
    performer: str = ""
    feedback: HubMessage | None = None
    finish: HubMessage | None = None
    idle_heartbeats: int = 0


class _Performer(Struct):
    """The known state of a performer.

    :ivar heartbeat_us: the time of the last heartbeat; 0 before the first.
    :ivar response_us: the time of the last RESPONSE, to any caller.
    """

    heartbeat: Heartbeat
    heartbeat_us: int = 0
    response_us: int = 0


class HubSkills(RosExecutor):
    """Executes skills through performers on a hub. Subclasses set the protocol."""

    protocol: ClassVar[HubProtocol]
    known_settings: ClassVar[tuple[str, ...]] = (*RosExecutor.known_settings, "agent-id")

    def __init__(self, context: ExecutorContext) -> None:
        super().__init__(context)
        if "agent-id" in self.settings and not self.protocol.has_agents:
            raise ConfigError(f"{type(self).__name__} has no setting 'agent-id': its messages name no robot")
        self._agent_id = self.setting("agent-id", "")
        self._skills = {
            name: HubSkill.parse(name, settings, self.protocol)
            for name, settings in _configured_skills(self.settings).items()
        }
        if not self._skills:
            raise ConfigError(f"{type(self).__name__} has no skills", hint="name them: skills: [move]")
        self.skills = tuple(self._skills)
        # unique among callers: performers tell them apart by their names only
        self._name = f"cxbridge_{self.agent}_{secrets.token_hex(2)}"
        self._hub: Hub | None = None
        self._open_request: _OpenRequest | None = None
        self._requests: dict[ActionKey, str] = {}  # node name of our recent REQUESTs by action
        self._performers: dict[str, _Performer] = {}

    @classmethod
    def skills_with(cls, settings: Mapping[str, Any]) -> tuple[str, ...]:
        return tuple(_configured_skills(nest_settings(settings)))

    @property
    def topic(self) -> str:
        return f"{self.node_settings.namespace}{self.protocol.topic}"

    def start(self) -> None:
        """Join the domain and the hub before the first request, so that performers discover this node."""
        namespace = self.node_settings.namespace
        self._hub = Hub(self.join(), self.protocol, namespace, self._handle_message, self._handle_heartbeat)

    def close(self) -> None:
        if self._hub is not None:
            self._hub.close()
        super().close()

    def execute(self, call: SkillCall) -> Steps:
        skill = self._skills[call.skill]
        key = ActionKey(skill.action, skill.arguments_for(call), self._agent_id)
        mapped = str(
            call.get(MAPPED_ACTION, "") if skill.mapped is None else fill_template(skill.mapped, call, {})
        )
        request = HubMessage(MessageKind.REQUEST, call.name or self._name, key, mapped)
        steps = self._perform(skill, _OpenRequest(request))
        return (yield from self.limit_time(skill.timeout_s, f"{key} on {self.topic}", steps))

    # --- steps --------------------------------------------------------------------------------------------

    def _perform(self, skill: HubSkill, open_request: _OpenRequest) -> Generator[Any, None, Progress]:
        self._open_request = open_request
        try:
            yield from self._find_performer(skill, open_request)
            finish = yield from self._follow(open_request)
        finally:
            self._open_request = None
            if open_request.performer and open_request.finish is None:
                self._send(MessageKind.CANCEL, open_request.performer, open_request.request.key)
        if not finish.success:
            reason = finish.status or f"{open_request.performer} has failed"
            raise SkillFailedError(reason, progress=finish.progress)
        return Progress(1.0, finish.status)

    def _find_performer(self, skill: HubSkill, open_request: _OpenRequest) -> Generator[None, None, None]:
        """Repeat the REQUEST until a performer has responded."""
        key, start_us, requests = open_request.request.key, self.clock.now_us(), 0
        while True:
            self.poll()
            if open_request.performer:
                return
            waited_us = self.clock.now_us() - start_us
            if waited_us > skill.patience_s * MICROSECONDS:
                raise SkillFailedError(f"no performer of {key} answers on {self.topic}")
            if waited_us >= requests * RETRY_S * MICROSECONDS:
                if requests >= _MAX_UNANSWERED:
                    self._reject_deaf_performers(key)
                self._send_request(open_request.request)
                requests += 1
            yield

    def _send_request(self, request: HubMessage) -> None:
        self._requests.pop(request.key, None)  # move the key to the end, as the most recent
        self._requests[request.key] = request.node
        while len(self._requests) > _MAX_REQUESTS:
            del self._requests[next(iter(self._requests))]
        assert self._hub is not None  # skills are executed only after the start
        self._hub.publish(request)

    def _reject_deaf_performers(self, key: ActionKey) -> None:
        """Reject performers that report READY but do not respond: their RESPONSE may be lost."""
        recent_us = self.clock.now_us() - round(_MAX_UNANSWERED * RETRY_S * MICROSECONDS)
        for name, performer in self._performers.items():
            heartbeat = performer.heartbeat
            is_ready = heartbeat.state == PerformerState.READY and performer.heartbeat_us > recent_us
            if is_ready and heartbeat.action == key.action and performer.response_us < recent_us:
                self._send(MessageKind.REJECT, name, key)

    def _follow(self, open_request: _OpenRequest) -> Generator[Progress | None, None, HubMessage]:
        """Yield the progress of a confirmed performer, and return its FINISH."""
        reported: HubMessage | None = None
        start_us = self.clock.now_us()
        while True:
            self.poll()
            if open_request.finish is not None:
                return open_request.finish
            self._check_performer(open_request, start_us)
            feedback = open_request.feedback
            if feedback is None or feedback is reported:
                yield None
            else:
                yield Progress(feedback.progress, feedback.status)
            reported = feedback

    def _check_performer(self, open_request: _OpenRequest, start_us: int) -> None:
        """Raise an error if the performer has vanished or has stopped the action."""
        performer = self._performers.get(open_request.performer)
        if performer is None or not performer.heartbeat_us:
            return  # without heartbeats, only the time limit helps
        if open_request.idle_heartbeats >= _MAX_IDLE_HEARTBEATS:
            raise SkillFailedError(
                f"{open_request.performer} does not perform it any more: it was restarted, or stopped"
            )
        silent_us = self.clock.now_us() - max(performer.heartbeat_us, start_us)
        if silent_us > SILENCE_S * MICROSECONDS:
            raise SkillFailedError(f"the performer {open_request.performer} has vanished")

    # --- the hub ------------------------------------------------------------------------------------------

    def _send(self, kind: MessageKind, node: str, key: ActionKey, mapped: str = "") -> None:
        assert self._hub is not None  # nothing is received, and no skill executed, before the start
        self._hub.publish(HubMessage(kind, node, key, mapped))

    def _handle_message(self, message: HubMessage) -> None:
        """Handle a message of any node, ourselves included."""
        if message.kind == MessageKind.REQUEST:
            # another caller requests the same action: the responses are for that caller
            if self._requests.get(message.key) != message.node:
                self._requests.pop(message.key, None)
        elif message.kind == MessageKind.RESPONSE:
            self._handle_response(message)
        open_request = self._open_request
        if (
            open_request is None
            or (message.node, message.key) != (open_request.performer, open_request.request.key)
            or open_request.finish
        ):
            return
        if message.kind == MessageKind.FEEDBACK:
            open_request.feedback, open_request.idle_heartbeats = message, 0
            performer = self._performer(message)
            performer.heartbeat_us = self.clock.now_us() if performer.heartbeat_us else 0
        elif message.kind == MessageKind.FINISH:
            open_request.finish = message

    def _handle_response(self, message: HubMessage) -> None:
        self._performer(message).response_us = self.clock.now_us()
        if message.key not in self._requests:
            return  # the response to another caller
        open_request = self._open_request
        if (
            open_request is not None
            and open_request.request.key == message.key
            and not open_request.performer
        ):
            open_request.performer = message.node
            self._send(MessageKind.CONFIRM, message.node, message.key, open_request.request.mapped)
        else:
            self._send(MessageKind.REJECT, message.node, message.key)

    def _performer(self, message: HubMessage) -> _Performer:
        return self._performers.setdefault(
            message.node, _Performer(Heartbeat(message.node, message.key.action, PerformerState.NOT_READY))
        )

    def _handle_heartbeat(self, heartbeat: Heartbeat) -> None:
        performer = self._performers.setdefault(heartbeat.node, _Performer(heartbeat))
        performer.heartbeat, performer.heartbeat_us = heartbeat, self.clock.now_us()
        open_request = self._open_request
        if open_request is not None and open_request.performer == heartbeat.node:
            is_running = heartbeat.state == PerformerState.RUNNING
            open_request.idle_heartbeats = 0 if is_running else open_request.idle_heartbeats + 1


def _configured_skills(settings: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the settings of each skill; a list names skills without settings."""
    skills = settings.get("skills", {})
    return skills if isinstance(skills, Mapping) else {str(name): {} for name in to_list(skills)}
