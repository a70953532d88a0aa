"""ROS 2 over rosbridge: a websocket to a server of rosbridge_suite, for robots with any RMW.

Messages are JSON there. Bytes are Base64, and numbers that JSON lacks (NaN, infinities) are ``null``: both
come as NaN. Actions are calls of the server's own: an accepted goal is not reported before its feedback or
its result, so each is taken for accepted at once.
"""

from __future__ import annotations

import base64
import binascii
import json
import math
import queue
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from functools import partial
from itertools import count
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from rosbags.interfaces import Nodetype
from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect

from cxbridge.errors import Ros2Error
from cxbridge.ros2.definitions import Definitions, FieldType
from cxbridge.ros2.messages import Codec, Message
from cxbridge.ros2.names import TypeName, parse_type
from cxbridge.ros2.node import AnswerLater, Client, Failed, Node, Publisher, Receive, Report
from cxbridge.ros2.qos import PROFILES, QosProfile
from cxbridge.ros2.topics import check_topic

if TYPE_CHECKING:
    from cxbridge.ros2.executor import NodeSettings

DEFAULT_URL: Final = "ws://localhost:9090"

_ACTION: Final = "/_action/"
_OPEN_S: Final = 5.0
_RETRY_S: Final = 1.0
_STOP_S: Final = 5.0
_ABORTED: Final = 6
_BYTES: Final = ("uint8", "byte")
_LOST: Final = {"op": ""}
_NAMES: Final = ("op", "id", "topic", "service", "action")

_Op = Mapping[str, Any]


class RosbridgeNode(Node):
    """A node behind a rosbridge. A lost connection comes back, and with it topics and services.

    :param name: the node's, for logs: in ROS all is done by the bridge's own node.
    :param definitions: the types that are known.
    :param url: of the bridge's websocket.
    :raises Ros2Error: when nobody is there, or it is none.
    """

    def __init__(
        self, name: str, definitions: Definitions, url: str = DEFAULT_URL, report: Report | None = None
    ) -> None:
        super().__init__(report)
        self.name = name
        self._definitions = definitions
        self._codec = Codec(definitions)
        self._ids = count(1)
        self._receivers: dict[str, list[tuple[TypeName, Receive]]] = {}
        self._calls: dict[str, tuple[TypeName, Receive, Failed]] = {}
        self._servers: dict[str, tuple[TypeName, AnswerLater]] = {}
        self._actions: dict[str, _Action] = {}
        self._later: list[Callable[[], None]] = []
        self._link = _Link(url)

    # --- what a node offers -------------------------------------------------------------------------------

    def publisher(self, topic: str, message_type: str, qos: QosProfile = PROFILES["default"]) -> Publisher:
        """Return a publisher; see the base class."""
        name = self._known(parse_type(message_type))
        op = {"op": "advertise", "topic": check_topic(topic), "type": str(name), "queue_size": qos.depth}
        op["latch"] = qos.durability == "transient_local"
        end = self._link.keep(op, {"op": "unadvertise", "topic": topic})

        def publish(message: Mapping[str, Any]) -> None:
            self._link.send({"op": "publish", "topic": topic, "msg": self._to_json(name, message)})

        return _Publisher(publish, end, self._link)

    def subscribe(
        self, topic: str, message_type: str, receive: Receive, qos: QosProfile = PROFILES["default"]
    ) -> Callable[[], None]:
        """Call ``receive`` for each message of a topic; see the base class."""
        name = parse_type(message_type, "msg")
        if _ACTION in topic:
            return self._action(topic, name).listen(topic.rpartition("/")[2], receive)
        self._known(name)
        entry = (name, receive)
        self._receivers.setdefault(check_topic(topic), []).append(entry)
        number = f"subscribe:{topic}:{next(self._ids)}"
        op = {"op": "subscribe", "id": number, "topic": topic, "type": str(name), "queue_length": qos.depth}
        end = self._link.keep(op, {"op": "unsubscribe", "id": number, "topic": topic})

        def stop() -> None:
            if entry in self._receivers[topic]:
                self._receivers[topic].remove(entry)
                end()

        return stop

    def client(self, service: str, service_type: str) -> Client:
        """Return a client of a service; see the base class."""
        name = parse_type(service_type, "srv")
        if _ACTION in service:
            return _ActionClient(self._link, self._action(service, name), service.rpartition("/")[2])
        self._known(name.derived("Request"))
        encode = partial(self._to_json, name.derived("Request"))
        return _Client(self._link, encode, partial(self._call, check_topic(service), name))

    def serve_later(self, service: str, service_type: str, answer: AnswerLater) -> Callable[[], None]:
        """Answer the requests of a service when there is an answer; see the base class."""
        if _ACTION in service:
            raise Ros2Error(
                "actions are not served over rosbridge", hint="use the transport dds for what ROS calls here"
            )
        name = parse_type(service_type, "srv")
        self._known(name.derived("Request"))
        self._servers[check_topic(service)] = (name, answer)
        op = {"op": "advertise_service", "service": service, "type": str(name)}
        end = self._link.keep(op, {"op": "unadvertise_service", "service": service})

        def stop() -> None:
            if self._servers.pop(service, None) is not None:
                end()

        return stop

    def poll(self, timeout_s: float = 0.0) -> bool:
        """Hand out all that has come; see the base class."""
        later, self._later = self._later, []
        for call in later:
            call()
        came = bool(later)
        for op in self._link.received(0.0 if came else timeout_s):
            came = True
            if op is _LOST:
                self._take_loss()
            elif (take := self._takers.get(op.get("op", ""))) is not None:
                take(self, op)
        return came

    def close(self) -> None:
        """Leave the bridge."""
        self._link.close()

    # --- what comes ---------------------------------------------------------------------------------------

    def _take_message(self, op: _Op) -> None:
        for name, receive in list(self._receivers.get(op.get("topic", ""), ())):
            receive(self._from_json(name, op.get("msg")))

    def _take_response(self, op: _Op) -> None:
        found = self._calls.pop(str(op.get("id")), None)
        if found is None:
            return
        name, done, failed = found
        if op.get("result", True):
            done(self._from_json(name.derived("Response"), op.get("values")))
        else:
            failed(str(op.get("values")))

    def _take_call(self, op: _Op) -> None:
        found = self._servers.get(op.get("service", ""))
        if found is None:
            return
        name, answer = found

        def reply(message: Mapping[str, Any]) -> None:
            values = self._to_json(name.derived("Response"), message)
            self._link.send(
                {**_part(op, "id", "service"), "op": "service_response", "values": values, "result": True}
            )

        answer(self._from_json(name.derived("Request"), op.get("args")), reply)

    def _take_status(self, op: _Op) -> None:
        if op.get("level") in ("error", "warning"):
            text = str(op.get("msg"))
            self.complain(f"status {text[:_KIND]}", f"the rosbridge says: {text[:_TEXT]}")

    def _take_of_action(self, op: _Op) -> None:
        action = self._actions.get(op.get("action", ""))
        if action is not None:
            action.take(op, self._from_json)

    def _take_loss(self) -> None:
        calls, self._calls = self._calls, {}
        for _, _, failed in calls.values():
            failed("the connection to the rosbridge was lost")
        for action in self._actions.values():
            action.lose()

    _takers: Final[Mapping[str, Callable[[RosbridgeNode, _Op], None]]] = {
        "publish": _take_message,
        "service_response": _take_response,
        "call_service": _take_call,
        "action_feedback": _take_of_action,
        "action_result": _take_of_action,
        "status": _take_status,
    }

    # --- helpers ------------------------------------------------------------------------------------------

    def _call(self, service: str, name: TypeName, args: Any, done: Receive, failed: Failed) -> None:
        number = str(next(self._ids))
        op = {"op": "call_service", "id": number, "service": service, "type": str(name), "args": args}
        self._calls[number] = (name, done, failed)
        if not self._link.send(op):
            self._later.append(lambda: self._take_response({"id": number, "result": False, "values": _AWAY}))

    def _action(self, place: str, name: TypeName) -> _Action:
        action = place.partition(_ACTION)[0]
        found = self._actions.get(action)
        if found is None:
            found = self._actions[action] = _Action(check_topic(action), self._do_later, self._send_goal)
        if name.kind == "action":
            found.type = TypeName(name.package, "action", name.name.partition("_")[0])
        return found

    def _do_later(self, call: Callable[[], None]) -> None:
        self._later.append(call)

    def _send_goal(self, action: _Action, number: str, goal: Mapping[str, Any]) -> bool:
        args = self._to_json(action.type.derived("Goal"), goal)
        op = {"op": "send_action_goal", "id": number, "action": action.name, "action_type": str(action.type)}
        return self._link.send({**op, "args": args, "feedback": True})

    def _known(self, name: TypeName) -> TypeName:
        self._definitions.fields(name)
        return name

    def _to_json(self, name: TypeName, message: Mapping[str, Any]) -> Any:
        # through CDR: the one place that checks messages
        return _plain(self._codec.decode(name, self._codec.encode(name, message)))

    def _from_json(self, name: TypeName, value: Any) -> Message:
        """Return a message; what is missing or broken has its default."""
        fields = self._definitions.fields(name)
        given = value if isinstance(value, Mapping) else {}
        return {field: self._value(kind, given.get(field)) for field, kind in fields if field != _NOTHING}

    def _value(self, kind: FieldType, value: Any) -> Any:
        node, rest = kind
        if node == Nodetype.NAME:
            return self._from_json(parse_type(rest), value)
        if node == Nodetype.BASE:
            return _base(rest[0], value)
        of = rest[0]
        if of[0] == Nodetype.BASE and of[1][0] in _BYTES:
            return _bytes(value)
        return [self._value(of, each) for each in value] if isinstance(value, list) else []


def join(name: str, definitions: Definitions, settings: NodeSettings, report: Report | None) -> RosbridgeNode:
    """Make a node of the settings of a configuration."""
    return RosbridgeNode(name, definitions, settings.url or DEFAULT_URL, report)


_KIND, _TEXT = 40, 500
"""Characters of a bridge's complaint by which it counts as the same one, and that are shown."""

_AWAY: Final = "the rosbridge is away"
_NOTHING: Final = "structure_needs_at_least_one_member"


class _Action:
    """An action of a robot, as the parts that ActionClient knows."""

    def __init__(
        self,
        name: str,
        later: Callable[[Callable[[], None]], None],
        send: Callable[[_Action, str, Mapping[str, Any]], bool],
    ) -> None:
        self.name, self.type = name, TypeName("", "action", "")
        self._later, self._send = later, send
        self._listeners: dict[str, list[Receive]] = {"feedback": [], "status": []}
        self._results: dict[str, tuple[Receive, Failed | None]] = {}

    def listen(self, part: str, receive: Receive) -> Callable[[], None]:
        listeners = self._listeners[part]
        listeners.append(receive)
        return lambda: listeners.remove(receive) if receive in listeners else None

    def send_goal(self, request: Mapping[str, Any], done: Receive) -> None:
        accepted = self._send(self, request["goal_id"]["uuid"].hex(), request["goal"])
        self._later(lambda: done({"accepted": accepted, "stamp": {"sec": 0, "nanosec": 0}}))

    def get_result(self, request: Mapping[str, Any], done: Receive, failed: Failed | None) -> None:
        self._results[request["goal_id"]["uuid"].hex()] = (done, failed)

    def take(self, op: _Op, from_json: Callable[[TypeName, Any], Message]) -> None:
        number = str(op.get("id"))
        if op["op"] == "action_feedback":
            feedback = from_json(self.type.derived("Feedback"), op.get("values"))
            message = {"goal_id": {"uuid": _uuid(number)}, "feedback": feedback}
            for receive in list(self._listeners["feedback"]):
                receive(message)
            return
        found = self._results.pop(number, None)
        if found is None:
            return
        done, failed = found
        if op.get("result", True):
            result = from_json(self.type.derived("Result"), op.get("values"))
            done({"status": _base("int8", op.get("status", _ABORTED)), "result": result})
        elif failed is not None:
            failed(str(op.get("values")))

    def lose(self) -> None:
        results, self._results = self._results, {}
        for _, failed in results.values():
            if failed is not None:
                failed("the connection to the rosbridge was lost")


class _Publisher(Publisher):
    def __init__(
        self, publish: Callable[[Mapping[str, Any]], None], end: Callable[[], None], link: _Link
    ) -> None:
        self._publish, self._end, self._link = publish, end, link

    def publish(self, message: Mapping[str, Any]) -> None:
        self._publish(message)

    @property
    def subscriptions(self) -> int:
        """One while the bridge is there: it does not report how many there are behind it."""
        return int(self._link.is_up)

    def close(self) -> None:
        self._end()


class _Client(Client):
    """Calls one after the other: the server of rosbridge_suite loses some of those that come at once."""

    def __init__(
        self,
        link: _Link,
        encode: Callable[[Mapping[str, Any]], Any],
        send: Callable[[Any, Receive, Failed], None],
    ) -> None:
        self._link, self._encode, self._send = link, encode, send
        self._numbers = count(1)
        self._waiting: dict[int, tuple[Any, Receive, Failed | None]] = {}
        self._under_way: int | None = None

    def call(self, request: Mapping[str, Any], done: Receive, failed: Failed | None = None) -> int:
        number = next(self._numbers)
        self._waiting[number] = (self._encode(request), done, failed)
        self._next()
        return number

    def forget(self, number: int) -> None:
        self._waiting.pop(number, None)
        if number == self._under_way:  # whose response may never come
            self._under_way = None
            self._next()

    def _next(self) -> None:
        if self._under_way is not None or not self._waiting:
            return
        number = self._under_way = next(iter(self._waiting))
        args, done, failed = self._waiting[number]

        def ended(receive: Callable[[Any], None] | None, what: Any) -> None:
            is_waited_for = self._waiting.pop(number, None) is not None
            if self._under_way == number:
                self._under_way = None
                self._next()
            if is_waited_for and receive is not None:
                receive(what)

        self._send(args, partial(ended, done), partial(ended, failed))

    @property
    def servers(self) -> frozenset[int]:
        """One while the bridge is there, another one after it was away."""
        return frozenset({self._link.connections}) if self._link.is_up else frozenset()

    def close(self) -> None:
        """Do nothing: the bridge keeps nothing for a client."""


class _ActionClient(Client):
    """One of the three services of an action."""

    def __init__(self, link: _Link, action: _Action, part: str) -> None:
        self._link, self._action, self._part = link, action, part

    def call(self, request: Mapping[str, Any], done: Receive, failed: Failed | None = None) -> int:
        if self._part == "send_goal":
            self._action.send_goal(request, done)
        elif self._part == "get_result":
            self._action.get_result(request, done, failed)
        else:
            number = request["goal_info"]["goal_id"]["uuid"].hex()
            self._link.send({"op": "cancel_action_goal", "id": number, "action": self._action.name})
        return 0

    def forget(self, number: int) -> None:
        """Do nothing: a goal that is forgotten is reported no more."""

    @property
    def servers(self) -> frozenset[int]:
        """As for services."""
        return frozenset({0}) if self._link.is_up else frozenset()

    def close(self) -> None:
        """Do nothing: the bridge keeps nothing for a client."""


class _Link:
    """The connection: comes back by itself, and repeats what is to be kept.

    A thread of its own receives, and connects again.

    :raises Ros2Error: when the first connection fails.
    """

    def __init__(self, url: str) -> None:
        if not url.startswith(("ws://", "wss://")):
            raise Ros2Error(f"'{url}' is no URL of a rosbridge", hint="e.g. ws://robot:9090")
        self._url = url
        self._inbox: queue.SimpleQueue[_Op] = queue.SimpleQueue()
        self._kept: dict[int, _Op] = {}
        self._numbers = count()
        self._lock = threading.Lock()
        self._closing = threading.Event()
        self.connections = 0
        """How many there have been."""
        self._socket: ClientConnection | None = None
        self._open = ExitStack()
        try:
            self._connect()
        except (OSError, WebSocketException, ValueError) as error:
            reason = str(error) or type(error).__name__
            raise Ros2Error(
                f"cannot connect to the rosbridge at {url}: {reason}",
                hint="is it running (ros2 launch rosbridge_server rosbridge_websocket_launch.xml), and is its"
                " port right?",
            ) from None
        self._thread = threading.Thread(target=self._run, name="rosbridge", daemon=True)
        self._thread.start()

    @property
    def is_up(self) -> bool:
        """Whether there is a connection now."""
        return self._socket is not None

    def keep(self, op: _Op, undo: _Op) -> Callable[[], None]:
        """Send an operation now and after each new connection; return what ends that."""
        number = next(self._numbers)
        with self._lock:
            self._kept[number] = op
        self.send(op)

        def end() -> None:
            with self._lock:
                self._kept.pop(number, None)
            self.send(undo)

        return end

    def send(self, op: _Op) -> bool:
        """Send an operation; return whether there was a connection."""
        socket = self._socket
        if socket is None:
            return False
        try:
            socket.send(json.dumps(op))
        except (WebSocketException, OSError):
            return False
        return True

    def received(self, timeout_s: float) -> Iterator[_Op]:
        """Yield the operations that came; wait so long for the first one."""
        try:
            yield self._inbox.get(timeout=timeout_s) if timeout_s > 0 else self._inbox.get_nowait()
            while True:
                yield self._inbox.get_nowait()
        except queue.Empty:
            return

    def close(self) -> None:
        self._closing.set()
        if self._socket is not None:
            self._socket.close()
        self._thread.join(_STOP_S)
        self._open.close()

    def _connect(self) -> None:
        self._open.close()  # what is left of the last one
        socket: ClientConnection = self._open.enter_context(
            connect(self._url, open_timeout=_OPEN_S, max_size=None, proxy=None)
        )
        with self._lock:
            kept = list(self._kept.values())
        self._socket = socket
        self.connections += 1
        for op in kept:
            self.send(op)

    def _run(self) -> None:
        while not self._closing.is_set():
            socket = self._socket
            if socket is not None:
                self._receive(socket)
                self._socket = None
                self._inbox.put(_LOST)
            elif not self._closing.wait(_RETRY_S):
                try:
                    self._connect()
                except (OSError, WebSocketException, ValueError):
                    continue

    def _receive(self, socket: ClientConnection) -> None:
        try:
            for text in socket:
                op = _parsed(text)
                if op is not None:
                    self._inbox.put(op)
        except (WebSocketException, OSError):
            return


def _parsed(text: str | bytes) -> _Op | None:
    """Return an operation; None when a bridge should not send such."""
    try:
        op = json.loads(text)
    except (ValueError, RecursionError):
        return None
    is_one = isinstance(op, dict) and all(isinstance(op.get(name, ""), str | int) for name in _NAMES)
    return op if is_one else None


def _uuid(number: str) -> bytes:
    try:
        return bytes.fromhex(number)
    except ValueError:
        return b""


def _part(op: _Op, *names: str) -> dict[str, Any]:
    return {name: op[name] for name in names if name in op}


def _base(kind: str, value: Any) -> Any:
    """Return a value as messages have it; one that is missing or of another type has its default."""
    if kind in ("float32", "float64"):
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        return float(value) if is_number else math.nan
    wanted: Any = {"bool": bool, "string": str}.get(kind, int)
    return value if isinstance(value, wanted) else wanted()


def _bytes(value: Any) -> bytes:
    if isinstance(value, str):
        try:
            return base64.b64decode(value)
        except (binascii.Error, ValueError):
            return b""
    numbers = value if isinstance(value, list) else []
    return bytes(each & 0xFF for each in numbers if isinstance(each, int))


def _plain(value: Any) -> Any:
    """Return a message as JSON has it."""
    if isinstance(value, Mapping):
        return {name: _plain(each) for name, each in value.items()}
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    if isinstance(value, list):
        return [_plain(each) for each in value]
    return value.item() if isinstance(value, np.generic) else value
