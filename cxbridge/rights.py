"""What clients may do: one table of all operations that can be reached from outside, on every way in.

Each operation needs a :class:`Right`, however it is asked for: a request over HTTP, a verb of
RequestInterface, a message on the blackboard, a frame of a protocol. What is in no table needs a higher one
than looking, so an operation that somebody adds and forgets here is refused, not open. See docs/security.md,
"Rights".
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from cxbridge.errors import CxbridgeError


class Right(IntEnum):
    """What a client needs; each contains those before."""

    LOOK = 0
    """See how things stand. Nobody who is let in is refused that."""
    CONTROL = 1
    """Change something: ``cxbridge/remote-control``."""
    PROGRAMS = 2
    """Run programs as the daemon's user: ``cxbridge/remote-programs``."""


class RefusedError(CxbridgeError):
    """Clients may not do that."""


_EXEC_SKILL: Final = ("SkillerInterface", "ExecSkillMessage")
_CALL_SKILL: Final = "POST /skiller/call"


@dataclass(frozen=True, slots=True)
class Rights:
    """What the clients of a daemon may do.

    :param control: they may change something.
    :param programs: they may run programs; only with ``control``.
    :param skills_are_programs: skill strings are evaluated as Lua (``/skiller/mode: fawkes``).
    """

    control: bool = True
    programs: bool = True
    skills_are_programs: bool = False

    def allow(self, right: Right) -> bool:
        """Whether clients have a right."""
        return right is Right.LOOK or (self.control and (right is Right.CONTROL or self.programs))

    def why_not(self, right: Right) -> str:
        """Return which setting is why clients have not a right."""
        name = "remote-programs" if self.control and right is Right.PROGRAMS else "remote-control"
        return f"cxbridge/{name} of the daemon is off"

    def check(self, right: Right, what: str) -> None:
        """Refuse what needs a right that clients have not.

        :param what: what was asked for.
        :raises RefusedError: when they have not.
        """
        if not self.allow(right):
            raise RefusedError(f"refused: {what}", hint=self.why_not(right))

    def check_message(self, interface_type: str, message_type: str) -> None:
        """Refuse a message that clients may not send.

        :raises RefusedError: when it is one.
        """
        right = right_of_message(interface_type, message_type)
        if self.skills_are_programs and (interface_type, message_type) == _EXEC_SKILL:
            right = Right.PROGRAMS
        self.check(right, f"{message_type} to {interface_type}")

    def of_request(self, method: str, path: str) -> Right:
        """Return what a request over HTTP needs here; see :func:`right_of_request`."""
        is_skill = self.skills_are_programs and f"{method} {path}" == _CALL_SKILL
        return Right.PROGRAMS if is_skill else right_of_request(method, path)

    def check_writer(self, uid: str) -> None:
        """Refuse a writer, when clients may only look.

        :raises RefusedError: when they may.
        """
        self.check(Right.CONTROL, f"to write {uid}")


EVERYTHING: Final = Rights()
"""For servers of a blackboard that no daemon is behind."""

REST: Final = {
    "POST /cxbridge/pause": Right.CONTROL,
    "POST /cxbridge/resume": Right.CONTROL,
    "POST /cxbridge/reset": Right.CONTROL,
    "POST /cxbridge/interrupt": Right.CONTROL,
    "POST /cxbridge/facts": Right.CONTROL,
    "PATCH /cxbridge/facts/{index}": Right.CONTROL,
    "DELETE /cxbridge/facts/{index}": Right.CONTROL,
    "POST /cxbridge/blackboard/{type}/{id+}/messages": Right.CONTROL,
    "POST /cxbridge/debugger/breakpoints": Right.CONTROL,
    "DELETE /cxbridge/debugger/breakpoints/{number}": Right.CONTROL,
    "DELETE /cxbridge/debugger/breakpoints": Right.CONTROL,
    "POST /cxbridge/debugger/step": Right.CONTROL,
    "POST /cxbridge/debugger/stop": Right.CONTROL,
    "POST /cxbridge/debugger/go-on": Right.CONTROL,
    "POST /cxbridge/environments": Right.CONTROL,
    "DELETE /cxbridge/environments/{env}": Right.CONTROL,
    "POST /cxbridge/environments/{env}/load": Right.PROGRAMS,
    "POST /cxbridge/environments/{env}/features": Right.CONTROL,
    "DELETE /cxbridge/environments/{env}/features/{feature}": Right.CONTROL,
    "POST /cxbridge/environments/{env}/loggers": Right.CONTROL,
    "DELETE /cxbridge/environments/{env}/loggers/{logger}": Right.CONTROL,
    "PUT /cxbridge/features/{feature}": Right.CONTROL,
    "DELETE /cxbridge/features/{feature}": Right.CONTROL,
    "PUT /cxbridge/components/{component}": Right.CONTROL,
    "PUT /cxbridge/environments/{env}/watch": Right.CONTROL,
    "PUT /cxbridge/environments/{env}/log": Right.CONTROL,
    "POST /cxbridge/environments/{env}/eval": Right.PROGRAMS,
    "POST /skiller/call": Right.CONTROL,
    "DELETE /skiller/skills/{id}": Right.CONTROL,
    "PUT /plugins/{name}": Right.CONTROL,
}
"""Requests over HTTP. A GET is a look, unless it is here."""

ASK: Final = {
    "break-list": Right.LOOK,
    "where": Right.LOOK,
    "state": Right.LOOK,
    "facts": Right.LOOK,
    "find-facts": Right.LOOK,
    "agenda": Right.LOOK,
    "env-list": Right.LOOK,
    "env-loggers": Right.LOOK,
    "feature-list": Right.LOOK,
    "component-list": Right.LOOK,
    "break-add": Right.CONTROL,
    "break-remove": Right.CONTROL,
    "step": Right.CONTROL,
    "stop": Right.CONTROL,
    "go-on": Right.CONTROL,
    "assert": Right.CONTROL,
    "retract": Right.CONTROL,
    "modify": Right.CONTROL,
    "env-create": Right.CONTROL,
    "env-destroy": Right.CONTROL,
    "env-feature": Right.CONTROL,
    "env-feature-remove": Right.CONTROL,
    "env-logger-add": Right.CONTROL,
    "env-logger-remove": Right.CONTROL,
    "feature-offer": Right.CONTROL,
    "feature-withdraw": Right.CONTROL,
    "component-change": Right.CONTROL,
    "env-watch": Right.CONTROL,
    "env-log": Right.CONTROL,
    "env-load": Right.PROGRAMS,
    "env-eval": Right.PROGRAMS,
}
"""Verbs of RequestInterface, over any transport of the blackboard."""

MESSAGES: Final = {
    ("ExplainInterface", "WhyMessage"): Right.LOOK,
    ("RequestInterface", "AskMessage"): Right.LOOK,  # the verb decides
    ("SkillerDebugInterface", "SetGraphMessage"): Right.LOOK,  # which graph is drawn
    ("SkillerDebugInterface", "SetGraphDirectionMessage"): Right.LOOK,
    ("SkillerDebugInterface", "SetGraphColoredMessage"): Right.LOOK,
}
"""Messages on the blackboard, over any transport. Any other needs :attr:`Right.CONTROL`."""

FRAMES: Final = {
    "zmq": {
        **dict.fromkeys(("hello", "close", "list", "watch", "sync", "beat", "bye"), Right.LOOK),
        **dict.fromkeys(("credit", "delivered"), Right.LOOK),
        "open": Right.LOOK,  # a writer: check_writer
        "send": Right.LOOK,  # check_message
        "write": Right.CONTROL,  # of a writer that was opened
    },
    "fawkes-blackboard": {
        **dict.fromkeys(("LIST_ALL", "LIST", "OPEN_FOR_READING", "CLOSE"), Right.LOOK),
        "INTERFACE_MESSAGE": Right.LOOK,  # check_message
        **dict.fromkeys(("OPEN_FOR_WRITING", "DATA_REFRESHED", "DATA_CHANGED"), Right.CONTROL),
    },
    "fawkes-plugins": {
        **dict.fromkeys(("LIST_AVAIL", "LIST_LOADED", "SUBSCRIBE_WATCH", "UNSUBSCRIBE_WATCH"), Right.LOOK),
        **dict.fromkeys(("LOAD", "UNLOAD"), Right.CONTROL),
    },
    "fawkes-configuration": {
        **dict.fromkeys(("GET_FLOAT", "GET_UINT", "GET_INT", "GET_BOOL", "GET_STRING"), Right.LOOK),
        **dict.fromkeys(("GET_VALUE", "SUBSCRIBE", "UNSUBSCRIBE"), Right.LOOK),
        # values name programs, Python classes and files to load: with the next reset they run
        **dict.fromkeys(("SET_FLOAT", "SET_UINT", "SET_INT", "SET_BOOL", "SET_STRING"), Right.PROGRAMS),
        **dict.fromkeys(("SET_DEFAULT_FLOAT", "SET_DEFAULT_UINT", "SET_DEFAULT_INT"), Right.PROGRAMS),
        **dict.fromkeys(("SET_DEFAULT_BOOL", "SET_DEFAULT_STRING", "ERASE_VALUE"), Right.PROGRAMS),
    },
    "fawkes-logger": dict.fromkeys(("SUBSCRIBE", "UNSUBSCRIBE"), Right.LOOK),
}
"""What clients send, by protocol."""


def right_of_request(method: str, path: str) -> Right:
    """Return what a request over HTTP needs.

    :param path: of the endpoint, below ``/api``.
    """
    return REST.get(f"{method} {path}", Right.LOOK if method == "GET" else Right.PROGRAMS)


def right_of_verb(verb: str) -> Right:
    """Return what a verb of RequestInterface needs."""
    return ASK.get(verb, Right.PROGRAMS)


def right_of_message(interface_type: str, message_type: str) -> Right:
    """Return what a message on the blackboard needs."""
    return MESSAGES.get((interface_type, message_type), Right.CONTROL)
