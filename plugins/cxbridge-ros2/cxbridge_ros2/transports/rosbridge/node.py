"""A node behind a rosbridge."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from itertools import count
from typing import Any, Final

from cxbridge.errors import Ros2Error
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.names import TypeName, parse_type
from cxbridge_ros2.node import AnswerLater, Client, Domain, Failed, Node, Publisher, Receive, Report
from cxbridge_ros2.qos import PROFILES, QosProfile
from cxbridge_ros2.topics import check_topic
from cxbridge_ros2.transports.rosbridge.actions import ActionPartClient, RosbridgeAction
from cxbridge_ros2.transports.rosbridge.connection import LOST, Operation, RosbridgeConnection
from cxbridge_ros2.transports.rosbridge.messages import JsonCodec
from cxbridge_ros2.transports.rosbridge.services import ServiceClient

DEFAULT_URL: Final = "ws://localhost:9090"

_ACTION: Final = "/_action/"
_AWAY: Final = "the rosbridge is away"
_KIND, _TEXT = 40, 500  # lengths of a complaint: for comparison with other complaints, and for display


class RosbridgeNode(Node):
    """A node behind a rosbridge. A lost connection is restored with its topics and services.

    :param name: for logs; in ROS, the bridge's own node does the work.
    :param url: the bridge's websocket.
    :raises Ros2Error: if there is no rosbridge.
    """

    def __init__(
        self, name: str, definitions: Definitions, url: str = DEFAULT_URL, report: Report | None = None
    ) -> None:
        super().__init__(report)
        self.name = name
        self._definitions = definitions
        self._codec = JsonCodec(definitions)
        self._ids = count(1)
        self._receivers: dict[str, list[tuple[TypeName, Receive]]] = {}
        self._calls: dict[str, tuple[TypeName, Receive, Failed]] = {}
        self._servers: dict[str, tuple[TypeName, AnswerLater]] = {}
        self._actions: dict[str, RosbridgeAction] = {}
        self._deferred_calls: list[Callable[[], None]] = []
        self._connection = RosbridgeConnection(url)

    # --- the interface of a node --------------------------------------------------------------------------

    def publisher(self, topic: str, message_type: str, qos: QosProfile = PROFILES["default"]) -> Publisher:
        name = self._known(parse_type(message_type))
        op = {"op": "advertise", "topic": check_topic(topic), "type": str(name), "queue_size": qos.depth}
        op["latch"] = qos.durability == "transient_local"
        end = self._connection.keep(op, {"op": "unadvertise", "topic": topic})

        def publish(message: Mapping[str, Any]) -> None:
            self._connection.send(
                {"op": "publish", "topic": topic, "msg": self._codec.to_json(name, message)}
            )

        return _Publisher(publish, end, self._connection)

    def _subscribe(
        self, topic: str, message_type: str, receive: Receive, qos: QosProfile
    ) -> Callable[[], None]:
        name = parse_type(message_type, "msg")
        if _ACTION in topic:
            return self._action(topic, name).listen(topic.rpartition("/")[2], receive)
        self._known(name)
        entry = (name, receive)
        self._receivers.setdefault(check_topic(topic), []).append(entry)
        number = f"subscribe:{topic}:{next(self._ids)}"
        op = {"op": "subscribe", "id": number, "topic": topic, "type": str(name), "queue_length": qos.depth}
        end = self._connection.keep(op, {"op": "unsubscribe", "id": number, "topic": topic})

        def stop() -> None:
            if entry in self._receivers[topic]:
                self._receivers[topic].remove(entry)
                end()

        return stop

    def client(self, service: str, service_type: str) -> Client:
        name = parse_type(service_type, "srv")
        if _ACTION in service:
            return ActionPartClient(self._connection, self._action(service, name), service.rpartition("/")[2])
        self._known(name.derived("Request"))
        encode = partial(self._codec.to_json, name.derived("Request"))
        return ServiceClient(self._connection, encode, partial(self._call, check_topic(service), name))

    def _serve_later(self, service: str, service_type: str, answer: AnswerLater) -> Callable[[], None]:
        if _ACTION in service:
            raise Ros2Error(
                "actions are not served over rosbridge", hint="use the transport dds for what ROS calls here"
            )
        name = parse_type(service_type, "srv")
        self._known(name.derived("Request"))
        self._servers[check_topic(service)] = (name, answer)
        op = {"op": "advertise_service", "service": service, "type": str(name)}
        end = self._connection.keep(op, {"op": "unadvertise_service", "service": service})

        def stop() -> None:
            if self._servers.pop(service, None) is not None:
                end()

        return stop

    def poll(self, timeout_s: float = 0.0) -> bool:
        later, self._deferred_calls = self._deferred_calls, []
        for call in later:
            call()
        for action in self._actions.values():
            action.cancel_again()
        came = bool(later)
        for op in self._connection.received(0.0 if came else timeout_s):
            came = True
            if op is LOST:
                self._take_loss()
            elif (take := self._takers.get(op.get("op", ""))) is not None:
                take(self, op)
        return came

    def close(self) -> None:
        self._connection.close()

    # --- incoming messages --------------------------------------------------------------------------------

    def _take_message(self, op: Operation) -> None:
        for name, receive in list(self._receivers.get(op.get("topic", ""), ())):
            receive(self._codec.from_json(name, op.get("msg")))

    def _take_response(self, op: Operation) -> None:
        pending = self._calls.pop(str(op.get("id")), None)
        if pending is None:
            return
        name, done, failed = pending
        if op.get("result", True):
            done(self._codec.from_json(name.derived("Response"), op.get("values")))
        else:
            failed(str(op.get("values")))

    def _take_call(self, op: Operation) -> None:
        server = self._servers.get(op.get("service", ""))
        if server is None:
            return
        name, answer = server

        def reply(message: Mapping[str, Any]) -> None:
            values = self._codec.to_json(name.derived("Response"), message)
            self._connection.send(
                {**_part(op, "id", "service"), "op": "service_response", "values": values, "result": True}
            )

        answer(self._codec.from_json(name.derived("Request"), op.get("args")), reply)

    def _take_status(self, op: Operation) -> None:
        if op.get("level") in ("error", "warning"):
            text = str(op.get("msg"))
            self.complain(f"status {text[:_KIND]}", f"the rosbridge says: {text[:_TEXT]}")

    def _take_of_action(self, op: Operation) -> None:
        action = self._actions.get(op.get("action", ""))
        if action is not None:
            action.take(op, self._codec.from_json)

    def _take_loss(self) -> None:
        calls, self._calls = self._calls, {}
        for _, _, failed in calls.values():
            failed("the connection to the rosbridge was lost")
        for action in self._actions.values():
            action.fail_all()

    _takers: Final[Mapping[str, Callable[[RosbridgeNode, Operation], None]]] = {
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
        if not self._connection.send(op):
            self._deferred_calls.append(
                lambda: self._take_response({"id": number, "result": False, "values": _AWAY})
            )

    def _action(self, place: str, name: TypeName) -> RosbridgeAction:
        action = place.partition(_ACTION)[0]
        known_action = self._actions.get(action)
        if known_action is None:
            known_action = self._actions[action] = RosbridgeAction(
                check_topic(action), self._connection, self._defer, self._send_goal
            )
        if name.kind == "action":
            known_action.type = TypeName(name.package, "action", name.name.partition("_")[0])
        return known_action

    def _defer(self, call: Callable[[], None]) -> None:
        self._deferred_calls.append(call)

    def _send_goal(self, action: RosbridgeAction, number: str, goal: Mapping[str, Any]) -> bool:
        args = self._codec.to_json(action.type.derived("Goal"), goal)
        op = {"op": "send_action_goal", "id": number, "action": action.name, "action_type": str(action.type)}
        return self._connection.send({**op, "args": args, "feedback": True})

    def _known(self, name: TypeName) -> TypeName:
        self._definitions.fields(name)
        return name


class _Publisher(Publisher):
    def __init__(
        self,
        publish: Callable[[Mapping[str, Any]], None],
        end: Callable[[], None],
        connection: RosbridgeConnection,
    ) -> None:
        self._publish, self._end, self._connection = publish, end, connection

    def publish(self, message: Mapping[str, Any]) -> None:
        self._publish(message)

    @property
    def subscriptions(self) -> int:
        """1 while the bridge is connected: the bridge does not report the number."""
        return int(self._connection.is_up)

    def close(self) -> None:
        self._end()


def join(name: str, definitions: Definitions, domain: Domain, report: Report | None) -> RosbridgeNode:
    return RosbridgeNode(name, definitions, domain.url or DEFAULT_URL, report)


def _part(op: Operation, *names: str) -> dict[str, Any]:
    return {name: op[name] for name in names if name in op}
