"""Takes requests to a daemon over its blackboard: an operation of :mod:`cxbridge.operations` each."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from cxbridge.daemon.board import DAEMON_ID, OWNER, REQUEST_TYPE
from cxbridge.daemon.components import component_row
from cxbridge.daemon.state import DaemonState
from cxbridge.errors import CxbridgeError
from cxbridge.operations.operation import OperationContext, ParameterError, plain
from cxbridge.printing import one_line
from cxbridge.rights import Right, Rights

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.daemon.components import DaemonComponents
    from cxbridge.daemon.nodes import ExecutiveNode
    from cxbridge.events import EventBus
    from cxbridge.executive.breakpoints import Stop
    from cxbridge.mainloop import MainLoop

MOST_REQUESTS: Final = 16
"""Requests that may wait."""

_ANSWER_BYTES: Final = 262_143
_REASON_BYTES: Final = 1000
_LOGGED: Final = 500


class DaemonRequests:
    """Takes requests and carries them out, one a loop.

    :param bus: what happens, for those who watch.
    :param node: the executive; None: there shall be none.
    :param rights: what clients may do.
    :param components: the daemon's, in the order of their start.
    :param loop: the main loop.
    """

    def __init__(
        self,
        board: BlackBoard,
        bus: EventBus,
        node: ExecutiveNode | None,
        rights: Rights,
        components: DaemonComponents,
        loop: MainLoop | None = None,
    ) -> None:
        # The fields of the interface come from its XML definition: there is no static type for them here.
        self._interface: Any = board.open_for_writing(
            REQUEST_TYPE, DAEMON_ID, owner=OWNER, queue_limit=MOST_REQUESTS
        )
        self._interface.write()
        self._log = bus.logger("Daemon")
        self._node = node
        self._stop: Stop | None = None
        self.context: Final = OperationContext(
            rights,
            node,
            lambda: [component_row(each) for each in components.status()],
            components.change_one,
            DaemonState(bus, node, loop).describe,
        )
        """What operations work on."""

    def attend(self) -> None:
        """Report where the rules are stopped, and carry out the next request. Called once a loop."""
        if (self._interface.msgq_empty() and self._stopped is self._stop) or not self._interface.valid:
            return
        self._report_stop()
        message = self._interface.msgq_pop()
        if message is not None:
            self._answer(str(message.verb), str(message.token), str(message.arguments))
            self._report_stop()

    def resume(self) -> None:
        """Go on where the rules are stopped."""
        if self._node is not None and self._node.debugger is not None:
            self._node.debugger.go_on()

    @property
    def _stopped(self) -> Stop | None:
        """Where the rules are stopped now."""
        return None if self._node is None else self._node.stopped

    def _report_stop(self) -> None:
        stop = self._stopped
        if stop is self._stop:
            return
        self._stop = stop
        if stop is not None:
            self._interface.stops += 1
        reason = "" if stop is None else stop.reason
        self._interface.stopped = reason.encode("utf-8", "replace")[:_REASON_BYTES].decode("utf-8", "ignore")
        self._interface.write()

    def _answer(self, verb: str, token: str, arguments: str) -> None:
        try:
            answer: dict[str, Any] = {"result": self._carry_out(verb, arguments)}
        except CxbridgeError as error:
            answer = _refusal(error)
        except Exception as error:  # noqa: BLE001  nothing that is asked may end a daemon
            answer = _refusal(CxbridgeError(f"a fault of cxbridge: {type(error).__name__}: {error}"))
        text = json.dumps(answer | {"token": token})
        if len(text) > _ANSWER_BYTES:
            text = json.dumps(
                _refusal(CxbridgeError("the answer is too long", hint="ask for less")) | {"token": token}
            )
        self._interface.answer = text
        self._interface.mark_data_changed()
        self._interface.write()

    def _carry_out(self, verb: str, arguments: str) -> Any:
        """Carry out a request and return what is to be answered, as JSON can have it.

        :raises CxbridgeError: when it makes no sense, is not allowed, or cannot be done.
        """
        from cxbridge.operations.table import operations  # noqa: PLC0415 - start-up time is a feature

        operation = operations().get(verb)
        if operation is None or not operation.is_verb:
            raise CxbridgeError(f"this daemon knows no request '{verb}'")
        if operation.right is not Right.LOOK:
            self.context.rights.check(operation.right, verb)
            self._log.info(f"A client asks: {verb} {_in_one_line(arguments)}")
        given = _parse(verb, arguments)
        try:
            return plain(operation.carry_out(self.context, operation.parse(given)))
        except ParameterError as error:
            raise CxbridgeError(f"the arguments of {verb} are wrong: {error.message}") from None
        except (KeyError, OverflowError, TypeError, ValueError) as error:
            raise CxbridgeError(f"the arguments of {verb} are wrong: {error!r}") from None


def _in_one_line(text: str) -> str:
    """Return the start of a client's text, for the log: it must not look like lines of others."""
    return one_line(text[:_LOGGED])


def _parse(verb: str, arguments: str) -> Mapping[str, Any]:
    """Return the arguments of a request.

    :raises CxbridgeError: when they are not a JSON object.
    """
    try:
        given = json.loads(arguments or "{}")
    except (ValueError, RecursionError) as error:
        raise CxbridgeError(f"the arguments of {verb} are not JSON: {error}") from None
    if not isinstance(given, dict):
        raise CxbridgeError(f"the arguments of {verb} are not a JSON object")
    return given


def _refusal(error: CxbridgeError) -> dict[str, Any]:
    where = f"{error.location}: " if error.location else ""
    return {"error": where + error.message, "hint": error.hint}
