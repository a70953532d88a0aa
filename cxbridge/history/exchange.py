"""The messages of a skill board in a recorded run, as exchanged between masters and executors.

A master is a client that requests skills, and an executor executes them. The messages have the form of a
topic in the ROS 2 CLIPS Executive of 2021 (fawkesrobotics/ros2-clips-executive): one REQUEST goes to all
executors, and each message has the id of a node. In REQUEST the node is the master, in all other messages the
executor.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final, NamedTuple, TypeAlias

from cxbridge.events import Event, InterfaceMessage
from cxbridge.history.model import (
    SKILL_FAILED,
    SKILL_FINAL,
    SKILL_RUNNING,
    Moment,
    SkillExecution,
)
from cxbridge.history.truncation import truncate

_BOARD: Final = "SkillBoardInterface::"
_EXECUTOR: Final = "SkillExecutorInterface::"
_REQUEST: Final = "RequestMessage"
_REFUSED: Final = "refused"
MAPPED_ACTION: Final = "mapped_action"
"""The name of the parameter with the mapped skill string of an action."""


def message_agent(event: InterfaceMessage) -> str:
    """Return the agent whose blackboard has a message; empty with a single agent."""
    return event.uid.partition("::")[2].rpartition("/")[0]


def _interface_id(event: InterfaceMessage) -> str:
    """Return the id of an interface without the agent's name."""
    return event.uid.partition("::")[2].rpartition("/")[2]


def is_board_message(event: InterfaceMessage) -> bool:
    """Return whether a message was exchanged between masters and executors."""
    return event.uid.startswith((_BOARD, _EXECUTOR))


@dataclass(frozen=True, slots=True)
class SkillMessage:
    """A message of the exchange.

    :param time_us: the time of sending, in microseconds since the epoch.
    :param type: ``REQUEST``, ``RESPONSE``, ``CONFIRM``, ``REJECT``, ``FEEDBACK``, ``FINISH`` or ``CANCEL``.
    :param node_id: the master's name in REQUEST, else the executor's.
    :param action: the skill.
    :param request: the name of the executive's request, or the number of its master.
    :param params: the values of the parameters in order; ``NAME=VALUE`` for parameters with names.
    :param agent_id: the agent that the skill is for; empty for none.
    :param mapped_action: the mapped skill string of the action; empty without one.
    :param status: the text of FEEDBACK and FINISH.
    :param success: whether FINISH reports a success.
    :param progress: the progress in FEEDBACK and FINISH, from 0 to 1.
    """

    time_us: int
    type: str
    node_id: str
    action: str
    params: tuple[str, ...]
    agent_id: str
    mapped_action: str
    # the request only links a message to its call and its plan-action: equal messages may differ in it
    request: str = field(default="", compare=False)
    status: str = ""
    success: bool = False
    progress: float = 0.0


class _Ticket(NamedTuple):
    """The identity of a request on a skill board.

    :param board: the id of the board; in a team, the name of the agent precedes the id.
    :param epoch: identifies the start of the board, because each start numbers its masters from 1 again.
    :param master: the number of the master.
    """

    board: str
    epoch: int
    master: int


_MasterMessage: TypeAlias = tuple[SkillMessage, str]
"""A message with the name of its master."""


class ExchangeReader:
    """Extracts the messages of masters and executors from the events of a run.

    Between processes a reply may be recorded before its request; the reply is delayed until the request.
    """

    def __init__(self) -> None:
        self._requests: dict[_Ticket, SkillMessage] = {}
        self._open_tickets: set[_Ticket] = set()
        self._early_replies: dict[_Ticket, list[InterfaceMessage]] = {}

    def read(self, events: Iterable[Event]) -> Iterator[_MasterMessage]:
        """Yield each message with the name of its master, a REQUEST to several executors once.

        Refused messages are left out.
        """
        for event in events:
            if isinstance(event, InterfaceMessage):
                yield from self.read_message(event)
        for ticket, replies in self._early_replies.items():
            yield from (self._make_message(ticket, reply) for reply in replies)

    def read_message(self, event: InterfaceMessage) -> Iterator[_MasterMessage]:
        """Yield a message; after a REQUEST, also the replies that were recorded before the REQUEST.

        Yield nothing for a refused message, an early reply, and the same REQUEST to another executor.
        """
        ticket = None if event.outcome == _REFUSED else _read_ticket(event)
        if ticket is None:
            return
        if event.message != _REQUEST:
            if ticket in self._requests:
                yield self._make_message(ticket, event)
            else:
                self._early_replies.setdefault(ticket, []).append(event)
        elif ticket not in self._open_tickets:  # otherwise the same request to another executor
            self._open_tickets.add(ticket)
            self._requests[ticket] = _make_request(ticket, event, event.values)
            yield self._make_message(ticket, event)
            yield from (
                self._make_message(ticket, early_reply) for early_reply in self._early_replies.pop(ticket, ())
            )

    def _make_message(self, ticket: _Ticket, event: InterfaceMessage) -> _MasterMessage:
        values, message_type = event.values, event.message.removesuffix("Message").upper()
        # after a refused confirmation the master asks again, and that request is a new message
        if message_type == "CONFIRM" or (
            message_type == "FINISH" and _read_outcome_name(values) == "REFUSED"
        ):
            self._open_tickets.discard(ticket)
        # a reply may lack its request: the recording began later, or left the request out
        request = self._requests.get(ticket) or _make_request(ticket, event, {})
        executor = str(values.get("executor", "")) or _interface_id(event)
        message = replace(
            request,
            time_us=event.time_us,
            type=message_type,
            node_id=request.node_id if event.message == _REQUEST else executor,
            **_read_report_fields(message_type, values),
        )
        return message, request.node_id


def _read_ticket(event: InterfaceMessage) -> _Ticket | None:
    """Return the ticket of a message; None if the message does not belong to a skill board."""
    if event.uid.startswith(_BOARD):
        board = _interface_id(event)
    elif event.uid.startswith(_EXECUTOR):
        board = str(event.values.get("board", ""))
    else:
        return None
    if agent := message_agent(event):
        board = f"{agent}/{board}"
    epoch, master = (event.values.get(name, 0) for name in ("epoch", "master"))
    # values may have any type: a recording may come from another program
    return _Ticket(board, epoch if isinstance(epoch, int) else 0, master if isinstance(master, int) else 0)


def _make_request(ticket: _Ticket, event: InterfaceMessage, values: Mapping[str, Any]) -> SkillMessage:
    """Return the REQUEST of a ticket.

    :param values: the values of the recorded message; empty if no message was recorded.
    """
    try:
        parameters = json.loads(str(values.get("parameters", "")))
    except (ValueError, RecursionError):  # a recording may contain any text
        parameters = {}
    if not isinstance(parameters, dict):
        parameters = {}
    mapped_action = str(parameters.pop(MAPPED_ACTION, ""))
    parameter_texts = tuple(
        str(value) if name.isdigit() else f"{name}={value}" for name, value in parameters.items()
    )
    name, skill, agent = (str(values.get(key, "")) for key in ("name", "skill", "agent"))
    return SkillMessage(
        event.time_us,
        "REQUEST",
        name or f"{ticket.board}-{ticket.master}",
        skill,
        parameter_texts,
        agent,
        mapped_action,
        request=name or str(ticket.master),
    )


def _read_report_fields(message_type: str, values: Any) -> dict[str, Any]:
    """Return status, success and progress of FEEDBACK or FINISH; empty for other messages."""
    if message_type == "FEEDBACK":
        return {"status": str(values.get("text", "")), "progress": read_progress(values)}
    if message_type != "FINISH":
        return {}
    outcome, error = _read_outcome_name(values), str(values.get("error", ""))
    success = outcome == "SUCCEEDED"
    return {
        "status": str(values.get("text", "") if success else error or outcome),
        "success": success,
        "progress": read_progress(values),
    }


def read_progress(values: Any) -> float:
    """Return the progress of a message; 0 if the value is not a number."""
    value = values.get("progress", 0.0)
    return float(value) if isinstance(value, int | float) else 0.0


def _read_outcome_name(values: Any) -> str:
    """Return the outcome of a FINISH by name."""
    # a running program has an enum item, a recording its name
    value = values.get("outcome", "")
    return str(getattr(value, "name", value))


class _RunningCall(NamedTuple):
    """A call that an executor executes.

    :param summary: the skill, its parameters and the agent.
    :param feedback_count: the number of FEEDBACK messages so far.
    """

    call: SkillExecution
    summary: str
    feedback_count: int


class BoardExecutions:
    """The executions of executors, in the form of skills of Skillers.

    :param limit: the maximum number of calls.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._exchange = ExchangeReader()
        self._running: dict[tuple[str, str], _RunningCall] = {}  # by agent and executor
        self.calls: list[SkillExecution] = []
        """The calls in the order of their start."""

    def record_message(self, event: InterfaceMessage, moment: Moment) -> None:
        """Process a message of a run."""
        env = message_agent(event)
        for message, _master in self._exchange.read_message(event):
            key = env, message.node_id
            if message.type == "CONFIRM":
                self._start_call(message, env, event.msgid, moment)
            elif key not in self._running or self._running[key].call.request != message.request:
                continue  # a busy executor refuses other requests
            elif message.type == "FEEDBACK":
                call, summary, count = self._running[key]
                self._running[key] = _RunningCall(call, summary, count + 1)
                # an executor has no skill string: pages show the progress in place of a skill string
                report = f"{message.progress:.0%} {message.status}".rstrip()
                noun = "messages" if count else "message"
                call.skill_string = truncate(f"{summary}: {count + 1} feedback {noun}, the last: {report}")
            elif message.type == "FINISH":
                call = self._running.pop(key).call
                call.end = moment
                call.status = SKILL_FINAL if message.success else SKILL_FAILED
                call.error = "" if message.success else message.status

    def _start_call(self, message: SkillMessage, env: str, msgid: int, moment: Moment) -> None:
        summary = f"{' '.join((message.action, *message.params))} of {message.agent_id or 'no agent'}"
        call = SkillExecution(
            env,
            message.node_id,
            truncate(summary),
            msgid,
            moment,
            None,
            SKILL_RUNNING,
            request=message.request,
        )
        previous = self._running.get((env, message.node_id))
        if previous is not None:  # the executor restarted, or the reply was lost
            previous.call.end, previous.call.status = moment, "stopped"
        self._running[env, message.node_id] = _RunningCall(call, summary, 0)
        if len(self.calls) < self._limit:
            self.calls.append(call)
