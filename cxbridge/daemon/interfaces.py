"""The interfaces of a daemon on its blackboard: the states of its components, and messages with commands.

``DaemonInterface::cxbridge`` is the daemon, each ``ComponentInterface::NAME`` a component. Every client of
the blackboard can therefore reach the daemon, and recorders record it.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from cxbridge.blackboard import BlackBoard, EventKind, Listener
from cxbridge.resources import VERSION
from cxbridge.run.components.manager import ComponentStatus

if TYPE_CHECKING:
    from cxbridge.interfaces.instance import Interface, Message

DAEMON_ID = "cxbridge"
"""The id of DaemonInterface and RequestInterface."""

EXPLAIN_TYPE = "ExplainInterface"
EXPLAIN_ID = "cxbridge"
REQUEST_TYPE = "RequestInterface"
OWNER = "cxbridge daemon"
"""The owner of the daemon's interfaces, for lists of readers and writers."""

MAX_COMMANDS = 16
"""The maximum number of waiting commands. Further commands are refused: a stuck loop processes none."""

INTERRUPT = "InterruptMessage"
"""The message that is processed on arrival, because the main loop may be stuck."""

COMMANDS = {
    "PauseMessage": "pause",
    "ResumeMessage": "resume",
    "ResetMessage": "reset",
    "ShutdownMessage": "shutdown",
    INTERRUPT: "interrupt",
}
"""The commands by the messages of DaemonInterface."""


class DaemonInterfaces:
    """Writes the state of a daemon and takes its commands.

    The constructor opens the interfaces, which are closed with the blackboard.

    :param components: the names of the components in the order of their start.
    :param time_source: the name of the clock.
    :param on_message: called with the type of each new message, in the thread of its arrival.
    """

    def __init__(
        self,
        board: BlackBoard,
        components: Sequence[str],
        time_source: str,
        on_message: Callable[[str], None] = lambda _type: None,
    ) -> None:
        # the class of the interface is made from XML at run time, so it has no static type
        daemon_interface: Any = board.open_for_writing(
            "DaemonInterface", DAEMON_ID, owner=OWNER, queue_limit=MAX_COMMANDS
        )
        self._daemon_interface = daemon_interface
        self._component_interfaces: dict[str, Any] = {}
        for position, name in enumerate(components, 1):
            interface: Any = board.open_for_writing("ComponentInterface", name, owner=OWNER)
            interface.position = position
            self._component_interfaces[name] = interface
        daemon_interface.pid = os.getpid()
        daemon_interface.started = board.clock.now_us()
        daemon_interface.version = VERSION
        daemon_interface.time_source = time_source
        self._lock = threading.RLock()  # the watchdog's thread publishes, too
        board.register_listener(_MessageListener(on_message), daemon_interface, EventKind.MESSAGE_RECEIVED)

    def publish(self, state: str, components: Sequence[ComponentStatus]) -> None:
        """Write the changed states of the daemon and its components.

        :param state: the name of a ``DaemonState``.
        """
        with self._lock:
            if not self._daemon_interface.valid:
                # the blackboard is closed; the watchdog or the end of the daemon may publish afterwards
                return
            for status in components:
                interface = self._component_interfaces[status.name]
                interface.state = int(status.state)
                interface.since = status.since_us
                interface.reason = status.reason
                self._write(interface)
            self._daemon_interface.state = state
            self._write(self._daemon_interface)

    def set_field(self, name: str, value: str) -> None:
        """Set a field of the daemon's interface, which the next :meth:`publish` writes."""
        with self._lock:
            if self._daemon_interface.valid:
                self._daemon_interface.set(name, value)

    @staticmethod
    def _write(interface: Any) -> None:
        # An unchanged interface is not written again. The first write happens always: readers wait for it.
        if interface.changed or not interface.timestamp_us:
            interface.write()

    def next_command(self) -> tuple[str, int] | None:
        """Remove the oldest command; return its name, empty for an unknown message, and the message's id.

        None without a waiting command.
        """
        message = self._daemon_interface.msgq_pop()
        return None if message is None else (COMMANDS.get(message.type, ""), message.id)

    def acknowledge(self, msgid: int) -> None:
        """Set the id of the last processed message, which the next :meth:`publish` writes."""
        with self._lock:
            if self._daemon_interface.valid:
                self._daemon_interface.msgid = msgid
                # a repeated command may leave all values equal, but its client waits for a change
                self._daemon_interface.mark_data_changed()


class _MessageListener(Listener):
    """Reports messages on arrival, before the main loop takes them from the queue."""

    def __init__(self, on_message: Callable[[str], None]) -> None:
        self._on_message = on_message

    def message_received(self, interface: Interface, message: Message) -> bool:  # noqa: ARG002 - a listener's signature
        """Report a message; return True, so that the message is queued."""
        self._on_message(message.type)
        return True
