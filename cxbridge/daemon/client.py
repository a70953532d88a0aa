"""Clients of a daemon, over its blackboard."""

from __future__ import annotations

import json
from typing import Any, Final
from uuid import uuid4

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.exclusive_control import CONTROLLER, name_controller
from cxbridge.blackboard.following import Deadline, Feed
from cxbridge.daemon.board import DAEMON_ID, EXPLAIN_ID, EXPLAIN_TYPE, REQUEST_TYPE
from cxbridge.errors import BlackBoardError, CxbridgeError
from cxbridge.plugins import package_with

OWNER = "cxbridge daemon client"
SKILLER = "SkillerInterface"
_TYPE = "DaemonInterface"

MOST_ARGUMENTS: Final = 8191
"""The maximal bytes of a request's arguments as JSON."""


class NoAnswerError(CxbridgeError):
    """A daemon has not replied in time."""

    exit_status = 3


def _check(board: BlackBoard) -> None:
    """Raise an error if the blackboard does not belong to a daemon."""
    if not any(info.has_writer for info in board.list(_TYPE, DAEMON_ID)):
        raise BlackBoardError(
            "this blackboard has no daemon", hint="only 'cxbridge daemon' reports its components"
        )


def read_status(board: BlackBoard) -> dict[str, Any]:
    """Return the states of a daemon and its components for JSON.

    ``stopped`` is the reason why the executive's rules are stopped, or empty. ``controllers`` maps Skillers
    to the clients that have control of them, or to ``nobody``.

    :raises BlackBoardError: if there is no daemon.
    """
    _check(board)
    with Feed(board, OWNER) as feed:
        daemon = feed.now(feed.open(_TYPE, DAEMON_ID)).values
        skillers = [
            (info.id, feed.open(info.type, info.id)) for info in board.list(SKILLER) if info.has_writer
        ]
        controllers = {
            skiller: name_controller(instance, str(feed.now(instance).values[CONTROLLER]))
            for skiller, instance in skillers
        }
        parts = [feed.now(feed.open(info.type, info.id)) for info in board.list("ComponentInterface")]
        rules = any(info.has_writer for info in board.list(REQUEST_TYPE, DAEMON_ID))
        stopped = feed.now(feed.open(REQUEST_TYPE, DAEMON_ID)).values["stopped"] if rules else ""
    parts.sort(key=lambda news: int(news.values["position"]))
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
                "name": news.uid.partition("::")[2],
                "state": news.values["state"].name,
                "since_us": news.values["since"],
                "reason": news.values["reason"],
            }
            for news in parts
        ],
    }


def command(board: BlackBoard, verb: str, timeout_s: float) -> bool:
    """Send ``Pause``, ``Resume``, ``Reset``, ``Interrupt`` or ``Shutdown``; return whether it was done.

    :raises BlackBoardError: if there is no daemon.
    """
    _check(board)
    deadline = Deadline(timeout_s)
    with Feed(board, OWNER) as feed:
        interface = feed.open(_TYPE, DAEMON_ID)
        before = feed.now(interface)
        msgid = interface.msgq_enqueue(interface.create_message(f"{verb}Message"))
        while (news := feed.next(deadline)) is not None:
            # a listener may get the write before the message once more
            stale = news.values == before.values and news.time_us <= before.time_us
            # a daemon that shuts down closes its interface instead of a reply
            if news.kind == "writer removed" or (not stale and news.values["msgid"] == msgid):
                return True
    return False


def ask_why(board: BlackBoard, name: str, kind: str, rules: int, timeout_s: float) -> dict[str, Any] | None:
    """Ask a daemon about a rule, a goal, an action, a fact or the run.

    :param kind: ``rule``, ``goal``, ``action``, ``fact``, ``run`` or empty.
    :param rules: the maximal number of firings before each step of a goal.
    :returns: ``lines`` and ``data``, or None if there is no reply in time.
    :raises CxbridgeError: if there is no daemon with an executive, or it has no explanation.
    """
    if not any(info.has_writer for info in board.list(EXPLAIN_TYPE, EXPLAIN_ID)):
        raise BlackBoardError(
            "there is no daemon with an executive to ask",
            hint=f"only a 'cxbridge daemon' with {package_with('why')} answers; or name a scenario, or a "
            "recording with --run",
        )
    deadline = Deadline(timeout_s)
    with Feed(board, OWNER) as feed:
        interface = feed.open(EXPLAIN_TYPE, EXPLAIN_ID)
        message: Any = interface.create_message("WhyMessage")
        message.name, message.kind, message.rules = name, kind, rules
        before = feed.now(interface)
        msgid = interface.msgq_enqueue(message)
        while (news := feed.next(deadline)) is not None:
            # a listener may get the write before the message once more
            stale = news.values == before.values and news.time_us <= before.time_us
            if news.kind == "writer removed":
                raise BlackBoardError("the daemon has ended")
            if not stale and news.values["msgid"] == msgid:
                answer: dict[str, Any] = json.loads(news.values["answer"])
                if "error" in answer:
                    raise CxbridgeError(answer["error"], hint=answer["hint"])
                return answer
    return None


def check_executive(board: BlackBoard) -> None:
    """Raise an error if the blackboard does not belong to a daemon."""
    if not any(info.has_writer for info in board.list(REQUEST_TYPE, DAEMON_ID)):
        raise BlackBoardError("there is no daemon here", hint="only 'cxbridge daemon' takes such requests")


def request(board: BlackBoard, verb: str, timeout_s: float, **arguments: Any) -> Any:
    """Send a request to a daemon and return the result; docs/debugging.md lists the verbs.

    :returns: a JSON value.
    :raises CxbridgeError: if there is no daemon, or it refuses, or does not reply in time.
    """
    check_executive(board)
    deadline = Deadline(timeout_s)
    with Feed(board, OWNER) as feed:
        interface = feed.open(REQUEST_TYPE, DAEMON_ID)
        message: Any = interface.create_message("AskMessage")
        message.verb, message.token = verb, uuid4().hex
        text = json.dumps(arguments)
        if len(text) > MOST_ARGUMENTS:
            raise CxbridgeError(
                f"the arguments of {verb} are too long", hint=f"{MOST_ARGUMENTS} bytes at most"
            )
        message.arguments = text
        token = message.token
        interface.msgq_enqueue(message)
        while (news := feed.next(deadline)) is not None:
            if news.kind == "writer removed":
                raise BlackBoardError("the daemon has ended")
            answer = json.loads(news.values["answer"] or "{}")
            if answer.get("token") == token:
                if "error" in answer:
                    raise CxbridgeError(answer["error"], hint=answer["hint"])
                return answer["result"]
    raise NoAnswerError(f"the daemon did not answer within {timeout_s:g} s")
