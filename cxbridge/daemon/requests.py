"""Requests to a daemon over its blackboard, each an operation of :mod:`cxbridge.daemon.operations`."""

from __future__ import annotations

import json
import threading
from collections import deque
from collections.abc import Mapping
from itertools import count, islice
from typing import TYPE_CHECKING, Any, Final

from cxbridge.daemon.interfaces import DAEMON_ID, OWNER, REQUEST_TYPE
from cxbridge.daemon.operations.operation import OperationContext, ParameterError, to_json
from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, EventBus, LogLine, SkillStatus
from cxbridge.executive.host.values import value_text
from cxbridge.history.forest import Forest, parent_id
from cxbridge.history.tree import goal_as_json
from cxbridge.history.truncation import truncate
from cxbridge.plugins import package_hint
from cxbridge.printing import one_line
from cxbridge.rights import Right, Rights

if TYPE_CHECKING:
    from collections.abc import Callable

    from cxbridge.blackboard import BlackBoard
    from cxbridge.daemon.executive_node import ExecutiveNode
    from cxbridge.executive.executive import RuleControl, RuleStop
    from cxbridge.mainloop import MainLoop
    from cxbridge.run.components.manager import ComponentStatus

# The limits keep a reply within the field of RequestInterface.
_MAX_GOALS: Final = 400
_MAX_ACTIONS: Final = 400
_MAX_LINES: Final = 200  # lines of the log
_MAX_TEXT_CHARACTERS: Final = 200


class StateCollector:
    """Collects the state of the agent for clients: goals, plan-actions, skills and the log.

    :param bus: emits log lines and the states of skills.
    :param node: the executive; None for a daemon without an executive.
    :param loop: counts the cycles.
    """

    def __init__(self, bus: EventBus, node: ExecutiveNode | None, loop: MainLoop) -> None:
        self._clock, self._node, self._loop = bus.clock, node, loop
        # the number of a log line, its level, its component and its text
        self._log_lines: deque[tuple[int, str, str, str]] = deque(maxlen=_MAX_LINES)
        self._line_numbers = count(1)
        self._lock = threading.Lock()
        self._skills: dict[str, tuple[str, str]] = {}  # the skill string and its status by Skiller
        bus.subscribe(self._record_event, LogLine, SkillStatus)

    def _record_event(self, event: Event) -> None:
        if isinstance(event, LogLine):
            # assigns the number under the lock, so that a client that asks for later lines misses none
            text = truncate(event.text, _MAX_TEXT_CHARACTERS)
            with self._lock:
                self._log_lines.append((next(self._line_numbers), event.level.value, event.component, text))
        elif isinstance(event, SkillStatus):
            self._skills[event.skiller] = (truncate(event.skill_string, _MAX_TEXT_CHARACTERS), event.status)

    def describe(self, parameters: Mapping[str, Any]) -> dict[str, Any]:
        """Return goals, plan-actions, skills and log lines as JSON values.

        :param parameters: ``since``: the number of a log line, to return later lines only. ``goals``: the
            maximum number of goals, by default 400. ``words``: a text, to return only the goals that contain
            it, and their ancestors.
        """
        since_number, goal_limit = int(parameters.get("since", 0)), int(parameters.get("goals", _MAX_GOALS))
        goals = self._list_goals(str(parameters.get("words", "")).lower())
        return {
            "time_us": self._clock.now_us(),
            "loops": self._loop.cycle_count,
            "goals": goals[:goal_limit],
            "more_goals": max(0, len(goals) - goal_limit),
            "actions": self._list_actions(),
            "skills": [[skiller, *skill_status] for skiller, skill_status in sorted(self._skills.items())],
            # a copy of the lines, because other threads append; a line begins with its number
            "log": [line for line in tuple(self._log_lines) if line[0] > since_number],
        }

    def _list_goals(self, search_text: str) -> list[dict[str, str]]:
        """Return the goals that contain a text, and their ancestors; all goals if the text is empty.

        :param search_text: the text in lower case.
        """
        if self._node is None:
            return []
        rows = {
            goal.goal: goal_as_json(goal) | {"error": truncate(goal.error, _MAX_TEXT_CHARACTERS)}
            for goal in self._node.goals.values()
        }
        if not search_text:
            return list(rows.values())
        forest = Forest({goal: parent_id(row["parent"]) for goal, row in rows.items()})
        goals = forest.goals_with_ancestors(
            goal for goal, row in rows.items() if search_text in " ".join(row.values()).lower()
        )
        return [row for goal, row in rows.items() if goal in goals]

    def _list_actions(self) -> list[dict[str, str]]:
        """Return the slots of the present plan-actions that tools show."""
        env = None if self._node is None else self._node.env
        if env is None:
            return []
        with env.lock:
            return [
                {
                    slot: truncate(value_text(slots.get(slot, "")), _MAX_TEXT_CHARACTERS)
                    for slot in ("goal-id", "plan-id", "id", "action-name", "param-values", "state")
                }
                for _, _, slots in islice(env.facts("plan-action"), _MAX_ACTIONS)
            ]


MAX_REQUESTS: Final = 16
"""The maximum number of waiting requests."""

_MAX_REPLY_BYTES: Final = 262_143  # size of the interface's field for replies, without the final NUL
_MAX_REASON_BYTES: Final = 1000  # the interface's field for the reason for a stop has 1024
_MAX_LOGGED_CHARACTERS: Final = 500  # of a request in the log


class DaemonRequests:
    """Takes requests and processes one per cycle, so that clients cannot delay the agent.

    :param node: the executive; None for a daemon without an executive.
    :param rights: the rights of clients.
    :param list_components: returns the states of the components in the order of the start.
    :param change_component: changes the state of a component by a transition.
    :param loop: counts the cycles.
    """

    def __init__(
        self,
        board: BlackBoard,
        bus: EventBus,
        node: ExecutiveNode | None,
        rights: Rights,
        list_components: Callable[[], list[ComponentStatus]],
        change_component: Callable[[str, str], None],
        loop: MainLoop,
    ) -> None:
        # the class of the interface is made from XML at run time, so it has no static type
        self._interface: Any = board.open_for_writing(
            REQUEST_TYPE, DAEMON_ID, owner=OWNER, queue_limit=MAX_REQUESTS
        )
        self._interface.write()
        self._log = bus.logger("Daemon")
        self._node = node
        self._reported_stop: RuleStop | None = None
        self.context: Final = OperationContext(
            rights,
            None if node is None else lambda: node.executive,
            lambda: [status.to_json() for status in list_components()],
            change_component,
            StateCollector(bus, node, loop).describe,
        )
        """The objects that operations work on."""

    def process_next(self) -> None:
        """Report whether the rules are stopped, and process the next request; called once per cycle."""
        is_idle = self._interface.msgq_empty() and self._current_stop is self._reported_stop
        if is_idle or not self._interface.valid:  # not valid: the blackboard is closed
            return
        self._report_stop()
        message = self._interface.msgq_pop()
        if message is not None:
            self._reply(str(message.verb), str(message.token), str(message.arguments))
            self._report_stop()

    def resume(self) -> None:
        """Resume stopped rules."""
        if (control := self._control) is not None:
            control.go_on()

    @property
    def _control(self) -> RuleControl | None:
        """The debugger of the rules; None if no client uses a debugger."""
        executive = None if self._node is None else self._node.executive
        return None if executive is None else executive.control

    @property
    def _current_stop(self) -> RuleStop | None:
        """The present stop of the rules; None if the rules run."""
        return None if (control := self._control) is None else control.stopped

    def _report_stop(self) -> None:
        stop = self._current_stop
        if stop is self._reported_stop:
            return
        self._reported_stop = stop
        if stop is not None:
            self._interface.stops += 1
        reason = ("" if stop is None else stop.reason).encode("utf-8", "replace")
        self._interface.stopped = reason[:_MAX_REASON_BYTES].decode("utf-8", "ignore")
        self._interface.write()

    def _reply(self, verb: str, token: str, arguments: str) -> None:
        try:
            reply: dict[str, Any] = {"result": self._carry_out(verb, arguments)}
        except CxbridgeError as error:
            reply = _make_error_reply(error)
        except Exception as error:  # noqa: BLE001 - no request may end a daemon
            reply = _make_error_reply(
                CxbridgeError(f"an internal error of cxbridge: {type(error).__name__}: {error}")
            )
        reply_json = json.dumps(reply | {"token": token})
        # JSON escapes other characters than ASCII, so a character is a byte
        if len(reply_json) > _MAX_REPLY_BYTES:
            reply = _make_error_reply(
                CxbridgeError(
                    f"the reply to '{verb}' is too long", hint="ask for fewer goals or facts at a time"
                )
            )
            reply_json = json.dumps(reply | {"token": token})
        self._interface.answer = reply_json
        self._interface.mark_data_changed()
        self._interface.write()

    def _carry_out(self, verb: str, arguments: str) -> Any:
        """Process a request and return the result for JSON."""
        from cxbridge.daemon.operations.table import operations  # noqa: PLC0415 - keeps the start of a daemon fast

        operation = operations().get(verb)
        if operation is None or not operation.is_verb:
            raise CxbridgeError(
                f"the request '{verb}' is unknown to this daemon",
                hint=package_hint(f"request {verb}") or None,
            )
        if operation.right is not Right.LOOK:
            self.context.rights.check(operation.right, verb)
            self._log.info(f"A client asks: {verb} {_log_excerpt(arguments)}")
        values = _parse(verb, arguments)
        try:
            return to_json(operation.carry_out(self.context, operation.parse(values)))
        except ParameterError as error:
            raise CxbridgeError(f"the arguments of {verb} are wrong: {error.message}") from None
        # a value of the right type may still be wrong for the operation
        except (KeyError, OverflowError, TypeError, ValueError) as error:
            raise CxbridgeError(
                f"the arguments of {verb} are wrong: {type(error).__name__}: {error}"
            ) from None


def _log_excerpt(text: str) -> str:
    """Return the start of a client's text on one line, so that it cannot imitate other log lines."""
    return one_line(text[:_MAX_LOGGED_CHARACTERS])


def _parse(verb: str, arguments: str) -> Mapping[str, Any]:
    """Return the arguments of a request by name.

    :raises CxbridgeError: if the arguments are not a JSON object.
    """
    try:
        values = json.loads(arguments or "{}")
    except (ValueError, RecursionError) as error:
        raise CxbridgeError(f"the arguments of {verb} are not JSON: {error}") from None
    if not isinstance(values, dict):
        raise CxbridgeError(f"the arguments of {verb} are not a JSON object")
    return values


def _make_error_reply(error: CxbridgeError) -> dict[str, Any]:
    return {"error": ": ".join(filter(None, (error.location, error.message))), "hint": error.hint}
