"""Clients of a daemon, over its blackboard.

A client sends a message and waits for the reply, which the daemon writes into a field of the same interface.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final
from uuid import uuid4

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.exclusive_control import CONTROLLER_FIELD, describe_controller
from cxbridge.blackboard.following import Deadline, Feed
from cxbridge.daemon.interfaces import DAEMON_ID, EXPLAIN_ID, EXPLAIN_TYPE, REQUEST_TYPE
from cxbridge.errors import BlackBoardError, CxbridgeError
from cxbridge.plugins import find_package_of

if TYPE_CHECKING:
    from cxbridge.blackboard.following import InterfaceChange
    from cxbridge.interfaces.instance import Interface, Message

OWNER = "cxbridge daemon client"
"""The owner of a client's interfaces, for lists of readers and writers."""

_SKILLER_TYPE = "SkillerInterface"
_DAEMON_TYPE = "DaemonInterface"

MAX_ARGUMENT_BYTES: Final = 8191
"""The maximum number of bytes of a request's arguments as JSON: the field's length without the final NUL."""


class NoAnswerError(CxbridgeError):
    """A daemon has not replied in time."""

    exit_status = 3


def _has_writer(board: BlackBoard, interface_type: str, interface_id: str) -> bool:
    return any(interface.has_writer for interface in board.list(interface_type, interface_id))


def check_daemon(board: BlackBoard) -> None:
    """Check that the blackboard belongs to a daemon.

    :raises BlackBoardError: if it does not.
    """
    if not _has_writer(board, REQUEST_TYPE, DAEMON_ID):
        raise BlackBoardError("this blackboard has no daemon", hint="start 'cxbridge daemon' there")


def read_status(board: BlackBoard) -> dict[str, Any]:
    """Return the states of a daemon and its components for JSON.

    ``stopped`` is the reason why the executive's rules are stopped, or empty. ``controllers`` maps Skillers
    to the clients that have control of them, or to ``nobody``.

    :raises BlackBoardError: if there is no daemon.
    """
    check_daemon(board)
    with Feed(board, OWNER) as feed:
        daemon = feed.read_state(feed.open(_DAEMON_TYPE, DAEMON_ID)).values
        skillers = [
            (interface.id, feed.open(interface.type, interface.id))
            for interface in board.list(_SKILLER_TYPE)
            if interface.has_writer
        ]
        controllers = {
            skiller: describe_controller(instance, str(feed.read_state(instance).values[CONTROLLER_FIELD]))
            for skiller, instance in skillers
        }
        components = [
            feed.read_state(feed.open(interface.type, interface.id))
            for interface in board.list("ComponentInterface")
        ]
        stopped = feed.read_state(feed.open(REQUEST_TYPE, DAEMON_ID)).values["stopped"]
    components.sort(key=lambda component: int(component.values["position"]))
    return {
        "state": daemon["state"].name,
        "version": daemon["version"],
        "pid": daemon["pid"],
        "started_us": daemon["started"],
        "clock": daemon["time_source"],
        "endpoints": daemon["endpoints"],
        "error": daemon["error"],
        "stopped": stopped,
        "controllers": controllers,
        "components": [
            {
                "name": component.uid.partition("::")[2],
                "state": component.values["state"].name,
                "since_us": component.values["since"],
                "reason": component.values["reason"],
            }
            for component in components
        ],
    }


def send_command(board: BlackBoard, verb: str, timeout_s: float) -> bool:
    """Send ``Pause``, ``Resume``, ``Reset``, ``Interrupt`` or ``Shutdown``.

    :returns: whether the daemon has processed the command before the timeout.
    :raises BlackBoardError: if there is no daemon.
    """
    check_daemon(board)
    with Feed(board, OWNER) as feed:
        interface = feed.open(_DAEMON_TYPE, DAEMON_ID)
        message = interface.create_message(f"{verb}Message")
        # a daemon that shuts down closes its interface instead of a reply
        return any(
            change.kind == "writer removed" or change.values["msgid"] == message.id
            for change in _send_and_follow(feed, interface, message, timeout_s)
        )


def _send_and_follow(
    feed: Feed, interface: Interface, message: Message, timeout_s: float
) -> Iterator[InterfaceChange]:
    """Send a message and yield the later changes of the interface, until the timeout."""
    deadline = Deadline(timeout_s)
    earlier_change = feed.read_state(interface)
    interface.msgq_enqueue(message)
    while (change := feed.wait_for_change(deadline)) is not None:
        # a listener may get a write that precedes the message a second time
        is_stale = change.values == earlier_change.values and change.time_us <= earlier_change.time_us
        if change.kind == "writer removed" or not is_stale:
            yield change


def _parse_reply(change: InterfaceChange) -> dict[str, Any]:
    """Return the reply in the field ``answer``.

    :raises BlackBoardError: if the daemon has ended.
    """
    if change.kind == "writer removed":
        raise BlackBoardError("the daemon has ended")
    reply: dict[str, Any] = json.loads(change.values["answer"] or "{}")
    return reply


def _check_reply(reply: dict[str, Any]) -> None:
    """Raise the daemon's error if it has refused the request."""
    if "error" in reply:
        raise CxbridgeError(reply["error"], hint=reply["hint"])


def ask_why(
    board: BlackBoard, name: str, kind: str, rule_limit: int, timeout_s: float
) -> dict[str, Any] | None:
    """Ask a daemon about a rule, a goal, an action, a fact or the run.

    :param kind: ``rule``, ``goal``, ``action``, ``fact`` or ``run``; empty: a rule of this name, or else an
        object of another kind.
    :param rule_limit: the maximum number of firings before each step of a goal.
    :returns: the reply with ``lines`` and ``data``, or None if there is no reply in time.
    :raises BlackBoardError: if there is no daemon with an executive, or it ends.
    :raises CxbridgeError: if there is no explanation of the name.
    """
    if not _has_writer(board, EXPLAIN_TYPE, EXPLAIN_ID):
        raise BlackBoardError(
            "there is no daemon with an executive to ask",
            hint=f"only a 'cxbridge daemon' with {find_package_of('why')} answers; or name a scenario, or a "
            "recording with --run",
        )
    with Feed(board, OWNER) as feed:
        interface = feed.open(EXPLAIN_TYPE, EXPLAIN_ID)
        message: Any = interface.create_message("WhyMessage")
        message.name, message.kind, message.rules = name, kind, rule_limit
        for change in _send_and_follow(feed, interface, message, timeout_s):
            reply = _parse_reply(change)
            if change.values["msgid"] == message.id:
                _check_reply(reply)
                return reply
    return None


def request(board: BlackBoard, verb: str, timeout_s: float, **arguments: Any) -> Any:
    """Send a request to a daemon and return the result; docs/debugging.md lists the verbs.

    :returns: a JSON value.
    :raises NoAnswerError: if the daemon does not reply in time.
    :raises CxbridgeError: if there is no daemon, it ends or refuses, or the arguments are too long.
    """
    check_daemon(board)
    arguments_json, token = json.dumps(arguments), uuid4().hex
    # JSON escapes other characters than ASCII, so a character is a byte
    if len(arguments_json) > MAX_ARGUMENT_BYTES:
        raise CxbridgeError(
            f"the arguments of {verb} are too long", hint=f"{MAX_ARGUMENT_BYTES} bytes at most"
        )
    with Feed(board, OWNER) as feed:
        interface = feed.open(REQUEST_TYPE, DAEMON_ID)
        message: Any = interface.create_message("AskMessage")
        message.verb, message.arguments, message.token = verb, arguments_json, token
        for change in _send_and_follow(feed, interface, message, timeout_s):
            # the same field holds the replies to all clients, so the token tells them apart
            reply = _parse_reply(change)
            if reply.get("token") == token:
                _check_reply(reply)
                return reply["result"]
    raise NoAnswerError(f"the daemon did not answer within {timeout_s:g} s")
