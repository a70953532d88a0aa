"""The calling side of a hub: an executor of the skill board whose skills performers execute.

The caller behaves like the callers of PlanSys2 and of ros2-clips-executive, except where these hang. The
caller repeats a REQUEST until a performer responds, confirms this performer, and rejects later RESPONSEs to
the REQUEST, even after the end of the action. A performer whose RESPONSE was lost would wait forever, so the
caller rejects the performer. A performer that vanishes or restarts is a failure of the skill.
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
from cxbridge_ros2.settings import check_keys, nest_settings, settings_by_name, to_list
from cxbridge_ros2.skills import fill_template

REQUEST_PERIOD_S: Final = 1.0  # time until a REQUEST without a RESPONSE is repeated, as in PlanSys2

# Time without a heartbeat after which a performer counts as gone: five periods of PlanSys2's heartbeats.
MAX_SILENCE_S: Final = 5.0

_SKILL_KEYS: Final = ("action", "arguments", "timeout", "patience")
# REQUESTs without a RESPONSE after which the caller rejects a performer that reports READY.
_MAX_UNANSWERED_REQUESTS: Final = 2
# Heartbeats that do not report RUNNING after which a confirmed performer counts as restarted. Two, since the
# first may have been sent before the CONFIRM arrived.
_MAX_IDLE_HEARTBEATS: Final = 2
# Limit of the stored REQUESTs whose late RESPONSEs are rejected, chosen freely.
_MAX_REQUESTS: Final = 100


class HubSkillSettings(Struct, frozen=True):
    """The configuration of a skill.

    :param action: the name of the action on the hub.
    :param arguments: templates of the arguments, with parameters of the skill; None for all parameters.
    :param timeout_s: the time limit of the skill.
    :param server_timeout_s: the time without a RESPONSE after which the skill fails.
    """

    action: str
    arguments: list[Any] | None
    timeout_s: float
    server_timeout_s: float

    @classmethod
    def parse(cls, name: str, settings: Any, protocol: HubProtocol) -> HubSkillSettings:
        """Parse the settings of a skill.

        :raises ConfigError: if a setting is unknown or invalid.
        """
        check_keys(settings, _SKILL_KEYS, f"the skill {name}")
        arguments = settings.get("arguments")
        return cls(
            action=str(settings.get("action", name)),
            arguments=None if arguments is None else to_list(arguments),
            timeout_s=parse_seconds(name, "timeout", settings.get("timeout", DEFAULT_TIMEOUT_S)),
            server_timeout_s=parse_seconds(
                name, "patience", settings.get("patience", protocol.server_timeout_s)
            ),
        )

    def make_arguments(self, call: SkillCall) -> tuple[str, ...]:
        """Return the arguments of the action for a call.

        :raises SkillError: if an argument is a list or a mapping, or the call lacks a parameter.
        """
        if self.arguments is None:
            argument_values = [value for name, value in call.parameters.items() if name != MAPPED_ACTION]
        else:
            argument_values = [fill_template(argument, call, {}) for argument in self.arguments]
        for value in argument_values:
            if isinstance(value, list | Mapping):
                raise SkillError(f"{call.skill}: {value!r} cannot be an argument of an action")
        return tuple(map(str, argument_values))


class _OpenRequest(Struct):
    """A REQUEST until the end of its action.

    :ivar performer_node: the node name of the confirmed performer; empty before the confirmation.
    :ivar feedback: the last FEEDBACK, or None.
    :ivar finish: the FINISH, or None.
    :ivar idle_heartbeat_count: the number of heartbeats without RUNNING since the last RUNNING or FEEDBACK.
    """

    request: HubMessage
    performer_node: str = ""
    feedback: HubMessage | None = None
    finish: HubMessage | None = None
    idle_heartbeat_count: int = 0


class _PerformerRecord(Struct):
    """The known state of a performer.

    :ivar heartbeat: the last heartbeat; before the first, an assumed heartbeat with NOT_READY.
    :ivar heartbeat_us: the time of the last heartbeat; 0 before the first heartbeat.
    :ivar response_us: the time of the last RESPONSE, to any caller; 0 before the first.
    """

    heartbeat: Heartbeat
    heartbeat_us: int = 0
    response_us: int = 0


class HubSkills(RosExecutor):
    """Executes skills through performers on a hub. Subclasses set the protocol."""

    protocol: ClassVar[HubProtocol]

    _hub: Hub  # from `start` on

    def __init__(self, context: ExecutorContext) -> None:
        super().__init__(context)
        self._skills = {
            name: HubSkillSettings.parse(name, settings, self.protocol)
            for name, settings in _read_skills(self.settings).items()
        }
        if not self._skills:
            raise ConfigError(f"{type(self).__name__} has no skills", hint="write skills: [move]")
        self.skills = tuple(self._skills)
        # unique among callers, since performers distinguish callers only by their names
        self._name = f"cxbridge_{self.agent}_{secrets.token_hex(2)}"
        self._open_request: _OpenRequest | None = None
        self._request_nodes: dict[ActionKey, str] = {}  # the node name in our recent REQUESTs by action
        self._performers: dict[str, _PerformerRecord] = {}

    @classmethod
    def skills_with(cls, settings: Mapping[str, Any]) -> tuple[str, ...]:
        return tuple(_read_skills(nest_settings(settings)))

    @property
    def topic(self) -> str:
        return f"{self.node_settings.namespace}{self.protocol.topic}"

    def start(self) -> None:
        """Join the domain and the hub before the first request, so that performers discover this node."""
        namespace = self.node_settings.namespace
        self._hub = Hub(self.join(), self.protocol, namespace, self._handle_message, self._handle_heartbeat)

    def execute(self, call: SkillCall) -> Steps:
        skill = self._skills[call.skill]
        key = ActionKey(skill.action, skill.make_arguments(call))
        skill_string = str(call.get(MAPPED_ACTION, ""))
        # performers label their calls with the node of the caller, which a passed-on REQUEST keeps
        request = HubMessage(MessageKind.REQUEST, call.label or self._name, key, skill_string)
        steps = self._execute_request(skill, _OpenRequest(request))
        return (yield from self.limit_time(skill.timeout_s, f"{key} on {self.topic}", steps))

    # --- execution ----------------------------------------------------------------------------------------

    def _execute_request(
        self, skill: HubSkillSettings, open_request: _OpenRequest
    ) -> Generator[Any, None, Progress]:
        self._open_request = open_request
        try:
            yield from self._await_performer(skill, open_request)
            finish = yield from self._yield_progress(open_request)
        finally:
            self._open_request = None
            if open_request.performer_node and open_request.finish is None:
                self._send_message(MessageKind.CANCEL, open_request.performer_node, open_request.request.key)
        if not finish.success:
            reason = finish.status or f"{open_request.performer_node} has failed"
            raise SkillFailedError(reason, progress=finish.progress)
        return Progress(1.0, finish.status)

    def _await_performer(
        self, skill: HubSkillSettings, open_request: _OpenRequest
    ) -> Generator[None, None, None]:
        """Repeat the REQUEST until a performer is confirmed.

        :raises SkillFailedError: if no performer responds in time.
        """
        key, start_us, request_count = open_request.request.key, self.clock.now_us(), 0
        while True:
            self.poll()
            if open_request.performer_node:
                return
            waited_us = self.clock.now_us() - start_us
            if waited_us > skill.server_timeout_s * MICROSECONDS:
                raise SkillFailedError(f"no performer of {key} answers on {self.topic}")
            if waited_us >= request_count * REQUEST_PERIOD_S * MICROSECONDS:
                if request_count >= _MAX_UNANSWERED_REQUESTS:
                    self._reject_silent_performers(key)
                self._send_request(open_request.request)
                request_count += 1
            yield

    def _send_request(self, request: HubMessage) -> None:
        self._request_nodes[request.key] = request.node
        while len(self._request_nodes) > _MAX_REQUESTS:
            del self._request_nodes[next(iter(self._request_nodes))]
        self._hub.publish(request)

    def _reject_silent_performers(self, key: ActionKey) -> None:
        """Reject performers that report READY but do not respond: their RESPONSE may be lost."""
        recent_us = self.clock.now_us() - round(_MAX_UNANSWERED_REQUESTS * REQUEST_PERIOD_S * MICROSECONDS)
        for name, performer in self._performers.items():
            heartbeat = performer.heartbeat
            is_ready = heartbeat.state == PerformerState.READY and performer.heartbeat_us > recent_us
            if is_ready and heartbeat.action == key.action and performer.response_us < recent_us:
                self._send_message(MessageKind.REJECT, name, key)

    def _yield_progress(self, open_request: _OpenRequest) -> Generator[Progress | None, None, HubMessage]:
        """Yield the progress of a confirmed performer, and return its FINISH."""
        last_feedback: HubMessage | None = None
        start_us = self.clock.now_us()
        while True:
            self.poll()
            if open_request.finish is not None:
                return open_request.finish
            self._check_performer(open_request, start_us)
            feedback = open_request.feedback
            if feedback is None or feedback is last_feedback:
                yield None
            else:
                yield Progress(feedback.progress, feedback.status)
            last_feedback = feedback

    def _check_performer(self, open_request: _OpenRequest, start_us: int) -> None:
        """Raise a `SkillFailedError` if the performer has vanished or has stopped the action."""
        performer = self._performers.get(open_request.performer_node)
        if performer is None or not performer.heartbeat_us:
            return  # a performer without heartbeats cannot be checked; the skill has a time limit
        if open_request.idle_heartbeat_count >= _MAX_IDLE_HEARTBEATS:
            raise SkillFailedError(
                f"{open_request.performer_node} no longer performs the action,"
                " since it was restarted or stopped"
            )
        silent_us = self.clock.now_us() - max(performer.heartbeat_us, start_us)
        if silent_us > MAX_SILENCE_S * MICROSECONDS:
            raise SkillFailedError(f"the performer {open_request.performer_node} has vanished")

    # --- messages -----------------------------------------------------------------------------------------

    def _send_message(self, kind: MessageKind, node: str, key: ActionKey, skill_string: str = "") -> None:
        self._hub.publish(HubMessage(kind, node, key, skill_string))

    def _handle_message(self, message: HubMessage) -> None:
        """Handle a message of another node or of this node."""
        if message.kind == MessageKind.REQUEST:
            # if another caller requests the same action, later responses are for that caller
            if self._request_nodes.get(message.key) != message.node:
                self._request_nodes.pop(message.key, None)
        elif message.kind == MessageKind.RESPONSE:
            self._handle_response(message)
        open_request = self._open_request
        if (
            open_request is None
            or (message.node, message.key) != (open_request.performer_node, open_request.request.key)
            or open_request.finish
        ):
            return
        if message.kind == MessageKind.FEEDBACK:
            open_request.feedback, open_request.idle_heartbeat_count = message, 0
            # feedback counts as a heartbeat, but only of a performer that has sent a heartbeat before
            performer = self._ensure_performer_record(message)
            performer.heartbeat_us = self.clock.now_us() if performer.heartbeat_us else 0
        elif message.kind == MessageKind.FINISH:
            open_request.finish = message

    def _handle_response(self, message: HubMessage) -> None:
        self._ensure_performer_record(message).response_us = self.clock.now_us()
        if message.key not in self._request_nodes:
            return  # this is a response to another caller
        open_request = self._open_request
        if (
            open_request is not None
            and open_request.request.key == message.key
            and not open_request.performer_node
        ):
            open_request.performer_node = message.node
            self._send_message(
                MessageKind.CONFIRM, message.node, message.key, open_request.request.skill_string
            )
        else:
            self._send_message(MessageKind.REJECT, message.node, message.key)

    def _ensure_performer_record(self, message: HubMessage) -> _PerformerRecord:
        return self._performers.setdefault(
            message.node,
            _PerformerRecord(Heartbeat(message.node, message.key.action, PerformerState.NOT_READY)),
        )

    def _handle_heartbeat(self, heartbeat: Heartbeat) -> None:
        performer = self._performers.setdefault(heartbeat.node, _PerformerRecord(heartbeat))
        performer.heartbeat, performer.heartbeat_us = heartbeat, self.clock.now_us()
        open_request = self._open_request
        if open_request is not None and open_request.performer_node == heartbeat.node:
            is_running = heartbeat.state == PerformerState.RUNNING
            open_request.idle_heartbeat_count = 0 if is_running else open_request.idle_heartbeat_count + 1


def _read_skills(settings: Mapping[str, Any]) -> Mapping[str, Any]:
    return settings_by_name(settings.get("skills", []))
