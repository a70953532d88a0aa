"""The performing side of a hub: executes requested actions with the skills of an agent on the skill board.

The performer behaves like the performers of PlanSys2 and of ros2-clips-executive, except where these hang. A
REQUEST waits for a free executor. A RESPONSE is repeated, since it may be lost. A RESPONSE reserves an
executor for a limited time only, but a later CONFIRM is still carried out.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from typing import Any, Final

from msgspec import Struct

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.closing import Closing
from cxbridge.errors import ConfigError, CxbridgeError, SkillError
from cxbridge.events import Logger
from cxbridge.history.exchange import MAPPED_ACTION
from cxbridge.rights import Rights, right_of_frame
from cxbridge.skiller.board.master import Master
from cxbridge.skiller.board.protocol import ExecutorState, MasterState, SkillCall
from cxbridge.skiller.board.service import LocalSkillCalls, parse_calls
from cxbridge.skiller.board.watch import ExecutorInfo
from cxbridge.skiller.mapping import ActionSkillMapping
from cxbridge_ros2.hub.hub import Hub
from cxbridge_ros2.hub.protocol import (
    ActionKey,
    Heartbeat,
    HubMessage,
    HubProtocol,
    MessageKind,
    PerformerState,
)
from cxbridge_ros2.settings import NodeSettings, check_keys, to_list

# Seconds after a RESPONSE without CONFIRM or REJECT, after which the reserved executor is free again; chosen
# freely.
MAX_RESERVATION_S: Final = 2.0

# Seconds until a RESPONSE is repeated: this node may not have discovered the subscription of a new caller.
RESPONSE_PERIOD_S: Final = 0.5

HEARTBEAT_PERIOD_S: Final = 1.0  # as in PlanSys2 and in ros2-clips-executive

_ACTION_KEYS: Final = ("parameters", "call")


class PerformedActionSettings(Struct, frozen=True):
    """The configuration of a performed action.

    :param parameters: names of the skill's parameters; empty for ``1``, ``2`` and so on.
    :param call_template: the template of a skill string as in action mappings; empty for a skill with the
        name of the action.
    """

    action: str
    parameters: tuple[str, ...] = ()
    call_template: str = ""

    @classmethod
    def parse(cls, action: str, settings: Any) -> PerformedActionSettings:
        """Parse the settings of an action.

        :raises ConfigError: if a setting is unknown, or the template of the call is invalid.
        """
        check_keys(settings, _ACTION_KEYS, f"the action {action}")
        names, call_template = to_list(settings.get("parameters", [])), str(settings.get("call", ""))
        # a warning of an action mapping is an error here, since the skill would get the text of a placeholder
        for _, problem in ActionSkillMapping({action: call_template}).check() if call_template else ():
            raise ConfigError(f"the call of the action {action}: {problem}")
        return cls(action, tuple(map(str, names)), call_template)

    def make_call(self, request: HubMessage, arguments: tuple[str, ...], agent: str) -> SkillCall:
        """Return the skill call for a REQUEST.

        :raises SkillError: if the REQUEST does not fit the configuration.
        """
        if self.parameters and len(arguments) != len(self.parameters):
            raise SkillError(
                f"{request.key} has {len(arguments)} arguments, but {self.action} has {len(self.parameters)}"
            )
        names = self.parameters or tuple(str(number) for number in range(1, len(arguments) + 1))
        values: dict[str, str] = dict(zip(names, arguments, strict=True))
        if not self.call_template:
            requested_skill = {MAPPED_ACTION: request.skill_string} if request.skill_string else {}
            return SkillCall(self.action, agent, values | requested_skill, request.node)
        mapped_skill = ActionSkillMapping({self.action: self.call_template}).map(self.action, values)
        if not mapped_skill.text:
            (_, problem), *_ = mapped_skill.messages  # the first message is the error
            raise SkillError(problem)
        calls = parse_calls(mapped_skill.text, agent)
        if len(calls) != 1:
            raise SkillError(f"{request.key} maps to '{mapped_skill.text}', which is not a single skill")
        return SkillCall(calls[0].skill, agent, calls[0].parameters, request.node)

    @property
    def skill(self) -> str:
        """The name of the skill: the part of the template before its arguments, or the name of the action."""
        return re.split(r"[{(]", self.call_template)[0].strip() or self.action


class PerformerSettings(Struct, frozen=True):
    """The settings of the performers on one hub.

    :param agent: the agent of the skill board whose skills are performed.
    :param name: the prefix of the performers' node names, which end with the name of the action.
    """

    protocol: HubProtocol
    agent: str
    name: str
    actions: tuple[PerformedActionSettings, ...]
    node: NodeSettings


class _Job(Struct, eq=False):
    """An action from the RESPONSE to the end of its execution.

    :ivar request: the REQUEST; the CONFIRM if that arrives after the reservation.
    :ivar node: the node name of the performer.
    :ivar call: the skill call, or the reason why the action cannot be performed.
    :ivar deadline_us: the time until which a CONFIRM must arrive.
    :ivar repeat_us: the time to repeat the RESPONSE; 0 for never, after the CONFIRM of another performer.
    :ivar master: the execution on the skill board; None before the CONFIRM.
    :ivar last_feedback: progress and status in the last FEEDBACK; None before the first.
    """

    request: HubMessage
    node: str
    call: SkillCall | str
    deadline_us: int = 0
    repeat_us: int = 0
    master: Master | None = None
    is_cancelled: bool = False
    last_feedback: tuple[float, str] | None = None


class HubPerformer(Closing):
    """Performs the configured actions on a hub, as a node.

    :param find_skill_calls: returns the calls to the skill board, or None without a skill board.
    :param rights: the rights of other nodes.
    :raises Ros2Error: if the domain cannot be joined.
    """

    def __init__(
        self,
        settings: PerformerSettings,
        find_skill_calls: Callable[[], LocalSkillCalls | None],
        rights: Rights,
        clock: Clock,
        log: Logger,
    ) -> None:
        self._protocol = settings.protocol
        self._actions = {action.action: action for action in settings.actions}
        # node names of performers: one per action, as in PlanSys2, since callers confirm a node for an action
        self._actions_by_node = {
            re.sub(r"\W", "_", f"{settings.name}_{action}"): action for action in self._actions
        }
        self._agent = settings.agent
        self._find_skill_calls, self._clock, self._log = find_skill_calls, clock, log
        # REQUESTs without a RESPONSE, each with the time until which a RESPONSE is useful
        self._pending_requests: dict[ActionKey, tuple[HubMessage, int]] = {}
        self._jobs: dict[ActionKey, _Job] = {}
        self._next_heartbeat_us = 0
        node_settings = settings.node
        self._node = node_settings.join(settings.name, node_settings.load_definitions(), log.warn, rights)
        self._hub = Hub(self._node, settings.protocol, node_settings.namespace, self._handle_message)

    @property
    def has_running_skills(self) -> bool:
        return any(job.master is not None for job in self._jobs.values())

    def loop(self) -> None:
        """Handle messages, repeat messages that may be lost, and publish heartbeats."""
        self._node.poll()
        now_us = self._clock.now_us()
        for key, (_, until_us) in list(self._pending_requests.items()):
            if now_us > until_us:
                del self._pending_requests[key]
            else:
                self._respond_if_free(key)
        for key, job in list(self._jobs.items()):
            if job.master is not None:
                continue
            if now_us > job.deadline_us:
                self._log.debug(f"{job.node}: no caller has confirmed {key}")
                del self._jobs[key]
            elif 0 < job.repeat_us <= now_us:
                self._send_response(job)
        if now_us >= self._next_heartbeat_us:
            self._next_heartbeat_us = now_us + round(HEARTBEAT_PERIOD_S * MICROSECONDS)
            for node, action in self._actions_by_node.items():
                self._hub.publish_heartbeat(
                    Heartbeat(node, action, self._find_performer_state(action)), now_us
                )

    def close(self) -> None:
        """Stop all executions, report their end, and leave the domain."""
        jobs, self._jobs = self._jobs, {}  # emptied first, so that stopped skills send no messages
        for job in jobs.values():
            if job.master is not None:
                self._stop_skill(job.master)
                self._publish_finish(job, success=False, status=f"the performer {job.node} was shut down")
        self._node.close()

    # --- messages of other nodes

    def _handle_message(self, message: HubMessage) -> None:
        key = message.key
        is_for_this_performer = self._actions_by_node.get(message.node) == key.action
        job = self._jobs.get(key)
        if message.kind == MessageKind.REQUEST and key.action in self._actions:
            # at this time the caller repeats the REQUEST, or gives up
            until_us = self._clock.now_us() + round(self._protocol.request_lifetime_s * MICROSECONDS)
            self._pending_requests[key] = message, until_us
            self._respond_if_free(key)
        elif message.kind == MessageKind.CONFIRM:
            self._pending_requests.pop(key, None)
            if is_for_this_performer and (job is None or job.master is None):
                self._begin_job(job or self._make_job(message))
            elif job is not None:
                job.repeat_us = 0
        elif is_for_this_performer and job is not None:
            if message.kind in (MessageKind.REJECT, MessageKind.CANCEL) and job.master is None:
                del self._jobs[key]
            elif message.kind == MessageKind.CANCEL and job.master is not None:
                job.is_cancelled = True
                self._stop_skill(job.master)

    def _respond_if_free(self, key: ActionKey) -> None:
        """Send a RESPONSE to a REQUEST if an executor is free; otherwise the REQUEST remains pending."""
        request, _ = self._pending_requests[key]
        job = self._jobs.get(key)
        if job is None:
            job = self._make_job(request)
            if isinstance(job.call, SkillCall) and not self._has_free_executor(job.call.skill):
                return
            self._jobs[key] = job
        elif job.master is not None:
            return
        # with a job that is not confirmed, the REQUEST is a repetition: our RESPONSE may be lost
        del self._pending_requests[key]
        job.deadline_us = self._clock.now_us() + round(MAX_RESERVATION_S * MICROSECONDS)
        self._send_response(job)

    def _send_response(self, job: _Job) -> None:
        job.repeat_us = self._clock.now_us() + round(RESPONSE_PERIOD_S * MICROSECONDS)
        self._publish(job, MessageKind.RESPONSE)

    def _publish(self, job: _Job, kind: MessageKind, **fields: Any) -> None:
        self._hub.publish(HubMessage(kind, job.node, job.request.key, job.request.skill_string, **fields))

    def _make_job(self, request: HubMessage) -> _Job:
        action = self._actions[request.key.action]
        node = next(node for node, name in self._actions_by_node.items() if name == request.key.action)
        call: SkillCall | str
        try:
            call = action.make_call(request, self._protocol.intended_arguments(request.key), self._agent)
        except CxbridgeError as error:
            call = error.message  # the FINISH reports the error, after CONFIRM
        return _Job(request, node, call)

    def _stop_skill(self, master: Master) -> None:
        calls = self._find_skill_calls()
        if calls is not None:
            calls.cancel(master.number)

    def _find_executors(self, skill: str) -> list[ExecutorInfo]:
        """Return the agent's executors that have a skill."""
        calls = self._find_skill_calls()
        executors = () if calls is None else calls.executors
        return [
            executor for executor in executors if executor.agent == self._agent and skill in executor.skills
        ]

    def _has_free_executor(self, skill: str) -> bool:
        """Return whether an executor for a skill is free, and not reserved for a caller."""
        idle_count = sum(executor.state is ExecutorState.IDLE for executor in self._find_executors(skill))
        reserved_count = sum(
            job.master is None or job.master.state is MasterState.ASKING for job in self._jobs.values()
        )
        return idle_count > reserved_count

    def _find_performer_state(self, action: str) -> PerformerState:
        if any(job.request.key.action == action and job.master is not None for job in self._jobs.values()):
            return PerformerState.RUNNING
        # NOT_READY without the right, so that callers do not wait for a performer that refuses their messages
        is_allowed = self._node.rights.allows(right_of_frame("ros2-performers", "word"))
        is_able = is_allowed and bool(self._find_executors(self._actions[action].skill))
        return PerformerState.READY if is_able else PerformerState.NOT_READY

    # --- execution

    def _begin_job(self, job: _Job) -> None:
        self._jobs[job.request.key] = job
        call = job.call
        try:
            if isinstance(call, str):
                raise SkillError(call)
            calls = self._find_skill_calls()
            if calls is None:
                raise SkillError("there is no skill board")
            job.master = calls.request(
                call.skill, call.parameters, call.agent, partial(self._report_state, job), call.label
            )
        except CxbridgeError as error:
            self._end_job(job, success=False, status=error.message)

    def _report_state(self, job: _Job, master: Master) -> None:
        """Send the state of a skill to the caller."""
        if self._jobs.get(job.request.key) is not job:
            return  # the performer was closed
        if master.state is MasterState.SUCCEEDED:
            self._end_job(job, success=True, status=master.feedback, progress=master.progress)
        elif master.is_over:
            reason = master.error or f"{master.skill} was cancelled"
            self._end_job(job, success=False, status=reason, progress=master.progress)
        elif master.state is MasterState.RUNNING and job.last_feedback != (master.progress, master.feedback):
            job.last_feedback = (master.progress, master.feedback)
            self._publish(job, MessageKind.FEEDBACK, progress=master.progress, status=master.feedback)

    def _end_job(self, job: _Job, **fields: Any) -> None:
        del self._jobs[job.request.key]
        self._publish_finish(job, **fields)

    def _publish_finish(self, job: _Job, **fields: Any) -> None:
        """Publish the FINISH of a job; after a CANCEL, the message that the protocol requires."""
        request = job.request
        finish = HubMessage(MessageKind.FINISH, job.node, request.key, request.skill_string, **fields)
        message = self._protocol.make_cancel_reply(finish) if job.is_cancelled else finish
        if message is not None:
            self._hub.publish(message)
