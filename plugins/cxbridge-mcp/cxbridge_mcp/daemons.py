"""The tools for a running daemon.

The daemon checks the rights of its clients; this server offers the operations that only read, and
those that the user allows.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import cxbridge as cx
from cxbridge.blackboard import parse_uid
from cxbridge.daemon.client import ask_why, read_status, request
from cxbridge.daemon.operations.table import verbs
from cxbridge.errors import CxbridgeError
from cxbridge.rights import Right
from cxbridge_mcp.recordings import MAX_ROWS, clean_answer

_ANSWER_TIMEOUT_S: Final = 30.0  # as in 'cxbridge why'
_OWNER: Final = "mcp"
_ANY_KIND: Final = ""  # an explanation may be of a goal or of a rule
_MAX_RULES: Final = 1  # the fired rules that an explanation lists before each step of a goal


class DaemonTools:
    """The tools for a daemon. Lists have at most `MAX_ROWS` rows unless a tool has a limit.

    The docstrings of the tools are the descriptions that the assistant reads, except for :meth:`ask_daemon`.
    A tool that fails raises CxbridgeError, whose text the assistant gets.

    :param url: the URL of the daemon's blackboard.
    :param allowed_operations: operations that the user allows in addition to those that only read.
    """

    def __init__(self, url: str, allowed_operations: Iterable[str]) -> None:
        self._url = url
        reading_operations = (name for name, right in verbs().items() if right is Right.LOOK)
        self._allowed_operations = {*reading_operations, *allowed_operations}

    def daemon_status(self) -> dict[str, Any]:
        """Return the state of the daemon and of its components."""
        with cx.connect(self._url) as board:
            return read_status(board)

    def list_interfaces(self, pattern: str = "*") -> list[dict[str, Any]]:
        """List the interfaces on the daemon's blackboard, with their writers and readers.

        :param pattern: TYPE or TYPE::ID, with the shell patterns *, ? and [].
        """
        interface_type, _, interface_id = pattern.partition("::")
        with cx.connect(self._url) as board:
            return [
                {"interface": info.uid, "writer": info.writer, "readers": list(info.readers)}
                for info in board.list(interface_type, interface_id or "*")[:MAX_ROWS]
            ]

    def read_interface(self, interface: str) -> dict[str, Any]:
        """Return the values of an interface.

        :param interface: TYPE::ID.
        """
        interface_type, interface_id = parse_uid(interface)
        with cx.connect(self._url) as board:
            if not any((info.type, info.id) == (interface_type, interface_id) for info in board.list()):
                raise CxbridgeError(
                    f"there is no interface {interface}", hint="list_interfaces lists all interfaces"
                )
            with board.open_for_reading(interface_type, interface_id, owner=_OWNER) as instance:
                instance.read()
                return dict(instance.as_dict())

    def list_facts(
        self, template: str = "", environment: str = "executive", limit: int = MAX_ROWS
    ) -> list[dict[str, Any]]:
        """List the facts of a CLIPS environment of the daemon, with their indices.

        :param template: only facts of this deftemplate.
        :param limit: the maximum number of facts, up to 1000.
        """
        with cx.connect(self._url) as board:
            facts = request(
                board, "facts", _ANSWER_TIMEOUT_S, env=environment, template=template, limit=limit
            )
        return [{"index": index, "fact": text} for index, text in facts]

    def why_in_daemon(self, name: str) -> str:
        """Return the reason why a goal of the running agent waits, or why a rule has not fired.

        :param name: a goal's id, a class of goals, or a rule.
        """
        with cx.connect(self._url) as board:
            reply = ask_why(board, name, _ANY_KIND, _MAX_RULES, _ANSWER_TIMEOUT_S)
        if reply is None:
            raise CxbridgeError("the daemon has not answered in time", hint="see daemon_status")
        return clean_answer("\n".join(reply["lines"]))

    def ask_daemon(self, operation: str, arguments: dict[str, Any] | None = None) -> Any:
        """Request an operation of the daemon, and return the result."""
        if operation not in self._allowed_operations:
            if operation not in verbs():
                raise CxbridgeError(f"there is no operation {operation}", hint=self.operations_text())
            hint = f"the user starts 'cxbridge mcp --allow {operation}'"
            raise CxbridgeError(f"the operation {operation} is not allowed", hint=hint)
        with cx.connect(self._url) as board:
            return request(board, operation, _ANSWER_TIMEOUT_S, **(arguments or {}))

    def operations_text(self) -> str:
        """Return a list of the allowed operations as text."""
        return f"the operations are {', '.join(sorted(self._allowed_operations))}"
