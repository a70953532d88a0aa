"""The rights of clients, and the rights that messages on the blackboard and frames of protocols require.

Each operation (:mod:`cxbridge.daemon.operations`) names its :class:`Right`. An endpoint over HTTP may name
its right; the default depends on the method. Messages and frames without an entry here require more than the
right to look, so that a forgotten entry gives nothing to clients that may only look. See docs/security.md,
"Rights".
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final

from msgspec import Struct

from cxbridge.errors import CxbridgeError


class Right(IntEnum):
    """A right of a client; each right includes the previous rights."""

    LOOK = 0
    """Read state; every client that may connect has this right."""
    CONTROL = 1
    """Change state: ``cxbridge/remote-control``."""
    PROGRAMS = 2
    """Run programs as the daemon's user: ``cxbridge/remote-programs``."""


class RefusedError(CxbridgeError):
    """Clients do not have the right to an operation."""


EXEC_SKILL: Final = ("SkillerInterface", "ExecSkillMessage")
"""The message that carries a skill string to a Skiller."""


class Rights(Struct, frozen=True):
    """The rights of the clients of a daemon.

    :param control: whether clients may change state.
    :param programs: whether clients may run programs; requires ``control``.
    :param skills_are_programs: whether skill strings are evaluated as Lua (``/skiller/mode: fawkes``).
    """

    control: bool = True
    programs: bool = True
    skills_are_programs: bool = False

    def allows(self, right: Right) -> bool:
        """Return whether clients have a right."""
        return right is Right.LOOK or (self.control and (right is Right.CONTROL or self.programs))

    def refusal_hint(self, right: Right) -> str:
        """Return a hint that names the setting which withholds a right."""
        name = "remote-programs" if self.control and right is Right.PROGRAMS else "remote-control"
        return f"cxbridge/{name} of the daemon is off"

    def check(self, right: Right, action: str) -> None:
        """Raise an error if clients do not have a right.

        :param action: the operation, for the error.
        :raises RefusedError: if clients do not have the right.
        """
        if not self.allows(right):
            raise RefusedError(f"refused: {action}", hint=self.refusal_hint(right))

    def message_right(self, interface_type: str, message_type: str) -> Right:
        """Return the right that a message on the blackboard requires with these settings."""
        is_program = self.skills_are_programs and (interface_type, message_type) == EXEC_SKILL
        return Right.PROGRAMS if is_program else right_of_message(interface_type, message_type)

    def check_message(self, interface_type: str, message_type: str) -> None:
        """Raise an error for a message that clients may not send.

        :raises RefusedError: if clients do not have the right that the message requires.
        """
        self.check(self.message_right(interface_type, message_type), f"{message_type} to {interface_type}")

    def check_writer(self, uid: str) -> None:
        """Raise an error, unless clients may open interfaces for writing.

        :raises RefusedError: if clients do not have :attr:`Right.CONTROL`.
        """
        self.check(Right.CONTROL, f"to write {uid}")


ALL_RIGHTS: Final = Rights()
"""The rights for servers of a blackboard without a daemon."""

MESSAGE_RIGHTS: Final = {
    ("ExplainInterface", "WhyMessage"): Right.LOOK,
    ("RequestInterface", "AskMessage"): Right.LOOK,  # the verb determines the right
    ("SkillerDebugInterface", "SetGraphMessage"): Right.LOOK,  # selects the drawn graph
    ("SkillerDebugInterface", "SetGraphDirectionMessage"): Right.LOOK,
    ("SkillerDebugInterface", "SetGraphColoredMessage"): Right.LOOK,
}
"""The messages that do not require :attr:`Right.CONTROL`, over any transport."""

FRAME_RIGHTS: Final = {
    "zmq": {
        **dict.fromkeys(("hello", "close", "list", "watch", "sync", "beat", "bye"), Right.LOOK),
        **dict.fromkeys(("credit", "delivered"), Right.LOOK),
        "open": Right.LOOK,  # see check_writer for writers
        "send": Right.LOOK,  # see check_message
        "write": Right.CONTROL,  # by an open writer
    },
    "fawkes-blackboard": {
        **dict.fromkeys(("LIST_ALL", "LIST", "OPEN_FOR_READING", "CLOSE"), Right.LOOK),
        "INTERFACE_MESSAGE": Right.LOOK,  # see check_message
        **dict.fromkeys(("OPEN_FOR_WRITING", "DATA_REFRESHED", "DATA_CHANGED"), Right.CONTROL),
    },
    "fawkes-plugins": dict.fromkeys(("LIST_AVAIL", "LIST_LOADED"), Right.LOOK),
    "fawkes-configuration": dict.fromkeys(("GET", "SUBSCRIBE", "UNSUBSCRIBE"), Right.LOOK),
    "fawkes-logger": dict.fromkeys(("SUBSCRIBE", "UNSUBSCRIBE"), Right.LOOK),
    "ros2-lifecycle": {
        **dict.fromkeys(("get_state", "get_available_states"), Right.LOOK),
        **dict.fromkeys(("get_available_transitions", "get_transition_graph"), Right.LOOK),
        "change_state": Right.CONTROL,
    },
    "ros2-parameters": {
        **dict.fromkeys(("get_parameters", "get_parameter_types"), Right.LOOK),
        **dict.fromkeys(("list_parameters", "describe_parameters"), Right.LOOK),
        **dict.fromkeys(("set_parameters", "set_parameters_atomically"), Right.CONTROL),
    },
    "ros2-action": {
        "get_result": Right.LOOK,
        "cancel_goal": Right.CONTROL,
        # send_goal: the server of the action defines the rights of its goals
    },
    "ros2-interfaces": {"write": Right.CONTROL},  # a message of an interface, see Rights.message_right
    "ros2-tf": dict.fromkeys(("/tf", "/tf_static"), Right.CONTROL),
    "ros2-performers": {"word": Right.CONTROL},
    "ros2-experts": {"read": Right.LOOK, **dict.fromkeys(("change", "plan"), Right.CONTROL)},
    "foxglove": {},  # the server accepts nothing from clients
}
"""The rights that frames, services and topics of client requests require, by protocol."""


def right_of_message(interface_type: str, message_type: str) -> Right:
    """Return the right that a message requires unless skill strings are programs, see `Rights`."""
    return MESSAGE_RIGHTS.get((interface_type, message_type), Right.CONTROL)


def right_of_frame(protocol: str, frame: str) -> Right:
    """Return the right that a frame of a protocol requires; :attr:`Right.PROGRAMS` without an entry."""
    return FRAME_RIGHTS.get(protocol, {}).get(frame, Right.PROGRAMS)
