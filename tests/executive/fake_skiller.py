"""A skiller played by the test, behind the CLIPS functions of the blackboard."""

from __future__ import annotations

from dataclasses import dataclass, field

from cxbridge.clock import split_us
from cxbridge.executive.feature import Feature
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, ExternalAddress, Symbol, Value

SERIAL = "00000000-0000-0000-0000-0000000000aa"
"""The serial of the executive's reading instance."""

_TEMPLATE = """
(deftemplate SkillerInterface
  (slot id (type STRING)) (multislot time (type INTEGER) (cardinality 2 2))
  (slot skill_string (type STRING)) (slot error (type STRING)) (slot exclusive_controller (type STRING))
  (slot msgid (type INTEGER)) (slot status (type SYMBOL)))
"""


@dataclass
class Message:
    """A message from CLIPS: type, interface and fields."""

    uid: str
    type: str
    fields: dict[str, Value] = field(default_factory=dict)


class FakeSkiller(Feature):
    """The feature ``blackboard`` with nothing but skillers.

    :param duration: loops that a skill runs.
    :param grants: whether the skiller grants control.
    :param writer: whether a skiller exists.
    """

    name = "blackboard"

    def __init__(self, *, duration: int = 1, grants: bool = True, writer: bool = True) -> None:
        self.duration = duration
        self.grants = grants
        self.writer = writer
        self.sent: list[Message] = []
        self.state: dict[str, Value] = {
            "skill_string": "",
            "error": "",
            "exclusive_controller": "",
            "msgid": 0,
            "status": Symbol("S_INACTIVE"),
        }
        self._fresh = True
        self._left: int | None = None
        self._messages: list[Message] = []
        self.env: ClipsEnvironment

    def init_context(self, env: ClipsEnvironment) -> None:
        """Define the functions that the core calls."""
        self.env = env
        if env.eval("(member$ blackboard-interface (get-deftemplate-list))") == FALSE:
            env.call("path-load", "blackboard.clp")
        env.define("blackboard-enable-time-read", self._enable_time_read)
        env.define("blackboard-preload", lambda _kind: None, 1)
        env.define("blackboard-open-reading", self._open, 2)
        env.define("blackboard-close", lambda _kind, _id: None, 2)
        env.define("blackboard-read", self._read)
        env.define("blackboard-create-msg", self._create, 2)
        env.define("blackboard-set-msg-field", self._set, 3)
        env.define("blackboard-send-msg", self._send, 1)

    def _enable_time_read(self) -> None:
        self.env.build("(defrule blackboard-read (declare (salience 1000)) (time $?) => (blackboard-read))")

    def _open(self, kind: str, identifier: str) -> None:
        if self.env.eval("(member$ SkillerInterface (get-deftemplate-list))") == FALSE:
            self.env.build(_TEMPLATE)
        uid = f"{kind}::{identifier}"
        self.env.assert_fact(
            "blackboard-interface",
            {"id": identifier, "type": kind, "uid": uid, "serial": SERIAL, "writing": FALSE},
        )

    def _read(self) -> None:
        if not self._fresh:
            return
        self._fresh = False
        for index, _, _ in list(self.env.facts("SkillerInterface")):
            self.env.retract(index)
        time = split_us(self.env.bus.clock.now_us())
        self.env.assert_fact("SkillerInterface", {"id": "Skiller", "time": time, **self.state})

    def _create(self, uid: str, kind: str) -> Value:
        self._messages.append(Message(uid, kind))
        return ExternalAddress(len(self._messages))

    def _set(self, message: ExternalAddress, name: str, value: Value) -> None:
        self._messages[message.handle - 1].fields[name] = value

    def _send(self, message: ExternalAddress) -> int:
        if not self.writer:
            return 0
        self.sent.append(self._messages[message.handle - 1])
        return len(self.sent)

    def write(self, **fields: Value) -> None:
        """Publish values of SkillerInterface; strings that begin with ``S_`` are status."""
        self.state |= {
            name: Symbol(value) if isinstance(value, str) and value.startswith("S_") else value
            for name, value in fields.items()
        }
        self._fresh = True

    def loop(self, seen: int) -> int:
        """Process the messages after the first ``seen``; return the number of messages."""
        if self._left is not None:
            self._left -= 1
            if self._left <= 0:
                self._left = None
                self.write(status="S_FINAL")
        for number, message in enumerate(self.sent[seen:], seen + 1):
            if message.type == "AcquireControlMessage" and self.grants:
                self.write(exclusive_controller=SERIAL)
            elif message.type == "ExecSkillMessage":
                self.write(skill_string=message.fields["skill_string"], msgid=number, status="S_RUNNING")
                self._left = self.duration
            elif message.type == "StopExecMessage":
                self.write(skill_string="", msgid=0, status="S_INACTIVE")
                self._left = None
        return len(self.sent)

    @property
    def steals(self) -> bool:
        """Whether the last request for control steals control."""
        requests = [message for message in self.sent if message.type == "AcquireControlMessage"]
        return bool(requests) and requests[-1].fields.get("steal_control") == TRUE
