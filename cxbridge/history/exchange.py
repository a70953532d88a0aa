"""The messages of a skill board in a recorded run, as exchanged between masters and executors.

They have the form of the topic in the ROS 2 CLIPS Executive of 2021 (fawkesrobotics/ros2-clips-executive):
one REQUEST for all executors, and an id in each message. The id in REQUEST is the master's, otherwise that of
the executor that sends or receives the message.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final, NamedTuple, TypeAlias

from cxbridge.events import Event, InterfaceMessage
from cxbridge.history.model import Moment, SkillExecution
from cxbridge.history.truncation import cut

_BOARD: Final = "SkillBoardInterface::"
_EXECUTOR: Final = "SkillExecutorInterface::"
_REQUEST: Final = "RequestMessage"
_REFUSED: Final = "refused"
MAPPED_ACTION: Final = "mapped_action"
"""The parameter with the mapped skill string of an action."""


def agent_of(event: InterfaceMessage) -> str:
    """Return the agent whose blackboard has a message; empty with a single agent."""
    return event.uid.partition("::")[2].rpartition("/")[0]


def _interface_id(event: InterfaceMessage) -> str:
    """Return the id of an interface without the agent's name."""
    return event.uid.partition("::")[2].rpartition("/")[2]


def is_exchanged(event: InterfaceMessage) -> bool:
    """Return whether a message was exchanged between masters and executors."""
    return event.uid.startswith((_BOARD, _EXECUTOR))


@dataclass(frozen=True, slots=True)
class SkillMessage:
    """A message of the exchange.

    :param time_us: the time of sending, in microseconds since the epoch.
    :param type: ``REQUEST``, ``RESPONSE``, ``CONFIRM``, ``REJECT``, ``FEEDBACK``, ``FINISH`` or ``CANCEL``.
    :param node_id: the master's name in REQUEST, else the executor's.
    :param request: the name of the executive's request, or the number of its master.
    :param params: the values of the parameters in order; ``NAME=VALUE`` for parameters with names.
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
    request: str = field(default="", compare=False)
    status: str = ""
    success: bool = False
    progress: float = 0.0


class _Ticket(NamedTuple):
    """A ticket of a skill board, with the agent's name before that of the board."""

    board: str
    epoch: int
    master: int


_MessageOfMaster: TypeAlias = tuple[SkillMessage, str]


class Exchange:
    """Extracts the messages of masters and executors from the events of a run.

    Between processes a reply may be recorded before its request; it is delayed until then.
    """

    def __init__(self) -> None:
        self._requests: dict[_Ticket, SkillMessage] = {}
        self._open: set[_Ticket] = set()
        self._early: dict[_Ticket, list[InterfaceMessage]] = {}

    def read(self, events: Iterable[Event]) -> Iterator[_MessageOfMaster]:
        """Yield each message with the name of its master."""
        for event in events:
            if isinstance(event, InterfaceMessage):
                yield from self.take(event)
        for ticket, early in self._early.items():
            yield from (self._message(ticket, event) for event in early)

    def take(self, event: InterfaceMessage) -> Iterator[_MessageOfMaster]:
        """Yield a message and the replies that waited for it; nothing before its request."""
        ticket = None if event.outcome == _REFUSED else _ticket(event)
        if ticket is None:
            return
        if event.message != _REQUEST:
            if ticket in self._requests:
                yield self._message(ticket, event)
            else:
                self._early.setdefault(ticket, []).append(event)
        elif ticket not in self._open:  # otherwise the same request to another executor
            self._open.add(ticket)
            self._requests[ticket] = _request_of(ticket, event, event.values)
            yield self._message(ticket, event)
            yield from (self._message(ticket, early) for early in self._early.pop(ticket, ()))

    def _message(self, ticket: _Ticket, event: InterfaceMessage) -> _MessageOfMaster:
        values, kind = event.values, event.message.removesuffix("Message").upper()
        # the master asks again after a refused confirmation: that request is a new one
        if kind == "CONFIRM" or (kind == "FINISH" and _outcome(values) == "REFUSED"):
            self._open.discard(ticket)
        # a reply without its request: the recording began later, or left the request out
        request = self._requests.get(ticket) or _request_of(ticket, event, {})
        executor = str(values.get("executor", "")) or _interface_id(event)
        node = request.node_id if event.message == _REQUEST else executor
        message = replace(
            request, time_us=event.time_us, type=kind, node_id=node, **_report_fields(kind, values)
        )
        return message, request.node_id


def _ticket(event: InterfaceMessage) -> _Ticket | None:
    """Return the ticket of a message, or None if it does not belong to a skill board."""
    if event.uid.startswith(_BOARD):
        board = _interface_id(event)
    elif event.uid.startswith(_EXECUTOR):
        board = str(event.values.get("board", ""))
    else:
        return None
    if agent := agent_of(event):
        board = f"{agent}/{board}"
    epoch, master = (event.values.get(name, 0) for name in ("epoch", "master"))
    # a recording may contain any value
    return _Ticket(board, epoch if isinstance(epoch, int) else 0, master if isinstance(master, int) else 0)


def _fallback_name(ticket: _Ticket) -> str:
    """Return a name for a master without a name."""
    return f"{ticket.board}-{ticket.master}"


def _request_of(ticket: _Ticket, event: InterfaceMessage, values: Mapping[str, Any]) -> SkillMessage:
    """Return the REQUEST of a ticket.

    :param values: the values of the recorded message; empty if it was not recorded.
    """
    try:
        parameters = json.loads(str(values.get("parameters", "")))
    except (ValueError, RecursionError):
        parameters = {}
    if not isinstance(parameters, dict):
        parameters = {}
    mapped = str(parameters.pop(MAPPED_ACTION, ""))
    texts = tuple(str(value) if name.isdigit() else f"{name}={value}" for name, value in parameters.items())
    name, skill, agent = (str(values.get(field, "")) for field in ("name", "skill", "agent"))
    node = name or _fallback_name(ticket)
    return SkillMessage(
        event.time_us, "REQUEST", node, skill, texts, agent, mapped, request=name or str(ticket.master)
    )


def _report_fields(kind: str, values: Any) -> dict[str, Any]:
    """Return status, success and progress of a message."""
    if kind == "FEEDBACK":
        return {"status": str(values.get("text", "")), "progress": progress_of(values)}
    if kind != "FINISH":
        return {}
    outcome, error = _outcome(values), str(values.get("error", ""))
    success = outcome == "SUCCEEDED"
    text = values.get("text", "") if success else error or outcome
    return {"status": str(text), "success": success, "progress": progress_of(values)}


def progress_of(values: Any) -> float:
    """Return the progress of a message, 0 if the value is not a number."""
    value = values.get("progress", 0.0)
    return float(value) if isinstance(value, int | float) else 0.0


def _outcome(values: Any) -> str:
    """Return the outcome of a FINISH by name."""
    # a running program has an enum item, a recording its name
    value = values.get("outcome", "")
    return str(getattr(value, "name", value))


_RUNNING, _FINAL, _FAILED = "S_RUNNING", "S_FINAL", "S_FAILED"


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

    :param limit: the maximal number of calls.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._exchange = Exchange()
        self._running: dict[tuple[str, str], _RunningCall] = {}
        self.calls: list[SkillExecution] = []
        """The calls in the order of their start."""
        self.lost = 0
        """The number of calls beyond the limit."""

    def take(self, event: InterfaceMessage, position: Moment) -> None:
        """Process a message of a run."""
        env = agent_of(event)
        for message, _master in self._exchange.take(event):
            key = env, message.node_id
            if message.type == "CONFIRM":
                self._start_call(message, env, event.msgid, position)
            elif key not in self._running or self._running[key].call.request != message.request:
                continue  # a busy executor refuses other requests
            elif message.type == "FEEDBACK":
                call, summary, count = self._running[key]
                self._running[key] = _RunningCall(call, summary, count + 1)
                report = f"{message.progress:.0%} {message.status}".rstrip()
                call.skill_string = cut(f"{summary}: {count + 1} times feedback, the last: {report}")
            elif message.type == "FINISH":
                call = self._running.pop(key).call
                call.end = position
                call.status = _FINAL if message.success else _FAILED
                call.error = "" if message.success else message.status

    def _start_call(self, message: SkillMessage, env: str, msgid: int, position: Moment) -> None:
        summary = f"{' '.join((message.action, *message.params))} of {message.agent_id or 'no agent'}"
        call = SkillExecution(
            env, message.node_id, cut(summary), msgid, position, None, _RUNNING, request=message.request
        )
        former = self._running.get((env, message.node_id))
        if former is not None:  # the executor restarted, or the reply was lost
            former.call.end, former.call.status = position, "stopped"
        self._running[env, message.node_id] = _RunningCall(call, summary, 0)
        if len(self.calls) < self._limit:
            self.calls.append(call)
        else:
            self.lost += 1
