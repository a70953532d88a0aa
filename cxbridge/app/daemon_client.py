"""A daemon, as clients of its blackboard see it."""

from __future__ import annotations

import json
from typing import Any

from cxbridge.app.daemon_board import DAEMON_ID, EXPLAIN_ID, EXPLAIN_TYPE
from cxbridge.app.following import Deadline, Feed
from cxbridge.blackboard import BlackBoard
from cxbridge.errors import BlackBoardError, CxbridgeError

OWNER = "cxbridge daemon client"
_TYPE = "DaemonInterface"


def _check(board: BlackBoard) -> None:
    """Raise when the blackboard is not that of a daemon."""
    if not any(info.has_writer for info in board.list(_TYPE, DAEMON_ID)):
        raise BlackBoardError(
            "this blackboard has no daemon", hint="only 'cxbridge daemon' tells of its components"
        )


def read_status(board: BlackBoard) -> dict[str, Any]:
    """Return how a daemon and its components stand, as JSON can have it.

    :raises BlackBoardError: when there is no daemon.
    """
    _check(board)
    with Feed(board, OWNER) as feed:
        daemon = feed.now(feed.open(_TYPE, DAEMON_ID)).values
        parts = [feed.now(feed.open(info.type, info.id)) for info in board.list("ComponentInterface")]
    parts.sort(key=lambda news: int(news.values["position"]))
    return {
        "state": daemon["state"].name,
        "version": daemon["version"],
        "pid": daemon["pid"],
        "started_us": daemon["started"],
        "clock": daemon["time_source"],
        "endpoints": daemon["endpoints"],
        "error": daemon["error"],
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


def command(board: BlackBoard, what: str, timeout_s: float) -> bool:
    """Tell a daemon to ``Pause``, ``Resume``, ``Reset`` or ``Shutdown``; return whether it has done it.

    :raises BlackBoardError: when there is no daemon.
    """
    _check(board)
    deadline = Deadline(timeout_s)
    with Feed(board, OWNER) as feed:
        interface = feed.open(_TYPE, DAEMON_ID)
        before = feed.now(interface)
        msgid = interface.msgq_enqueue(interface.create_message(f"{what}Message"))
        while (news := feed.next(deadline)) is not None:
            stale = news.values == before.values and news.time_us <= before.time_us
            if news.kind == "writer removed" or (not stale and news.values["msgid"] == msgid):
                return True
    return False


def ask_why(board: BlackBoard, name: str, kind: str, rules: int, timeout_s: float) -> dict[str, Any] | None:
    """Ask a daemon about a rule or a goal.

    :param kind: ``rule``, ``goal`` or empty.
    :param rules: how many rules to tell of those that fired before each step of a goal.
    :returns: ``lines`` and ``data``; None when it did not answer in time.
    :raises CxbridgeError: when there is no daemon with an executive, or it has nothing to tell.
    """
    if not any(info.has_writer for info in board.list(EXPLAIN_TYPE, EXPLAIN_ID)):
        raise BlackBoardError(
            "there is no daemon with an executive to ask",
            hint="only 'cxbridge daemon' answers; or name a scenario, or a recording with --run",
        )
    deadline = Deadline(timeout_s)
    with Feed(board, OWNER) as feed:
        interface = feed.open(EXPLAIN_TYPE, EXPLAIN_ID)
        message: Any = interface.create_message("WhyMessage")
        message.name, message.kind, message.rules = name, kind, rules
        before = feed.now(interface)
        msgid = interface.msgq_enqueue(message)
        while (news := feed.next(deadline)) is not None:
            stale = news.values == before.values and news.time_us <= before.time_us
            if news.kind == "writer removed":
                raise BlackBoardError("the daemon has ended")
            if not stale and news.values["msgid"] == msgid:
                answer: dict[str, Any] = json.loads(news.values["answer"])
                if "error" in answer:
                    raise CxbridgeError(answer["error"], hint=answer["hint"])
                return answer
    return None
