"""A node that reaches ROS through a rosbridge, and converts its calls to operations of the bridge."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from itertools import count
from typing import Any, Final

from cxbridge.errors import Ros2Error
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.names import TypeName, check_ros_name, parse_type
from cxbridge_ros2.node import (
    Client,
    FailureCallback,
    MessageCallback,
    Node,
    ProblemCallback,
    Publisher,
    RequestHandler,
)
from cxbridge_ros2.qos import PROFILES, QosProfile
from cxbridge_ros2.transports.rosbridge.clients import ActionServiceClient, RosbridgeAction, ServiceClient
from cxbridge_ros2.transports.rosbridge.connection import CONNECTION_LOST, Operation, RosbridgeConnection
from cxbridge_ros2.transports.rosbridge.messages import JsonCodec

DEFAULT_URL: Final = "ws://localhost:9090"

_ACTION_INFIX: Final = "/_action/"  # between the name of an action and those of its topics and services
_UNREACHABLE_REASON: Final = "the rosbridge is unreachable"
_LOST_REASON: Final = "the connection to the rosbridge was lost"
# Numbers of characters at the start of a status: the compared start identifies the problem, the displayed
# start is reported.
_COMPARED_LENGTH, _DISPLAYED_LENGTH = 40, 500


class RosbridgeNode(Node):
    """A node behind a rosbridge. A lost connection is restored with its topics and services.

    :param name: the name of the node, which ROS does not see: in the graph of ROS, the bridge has the topics.
    :param url: the URL of the bridge's websocket; by default :data:`DEFAULT_URL`.
    :raises Ros2Error: if there is no rosbridge, or the URL is not that of a websocket.
    """

    def __init__(
        self,
        name: str,
        definitions: Definitions,
        url: str | None = None,
        report: ProblemCallback | None = None,
    ) -> None:
        super().__init__(report)
        self.name = name
        self._definitions = definitions
        self._codec = JsonCodec(definitions)
        self._ids = count(1)
        self._subscriptions: dict[str, list[tuple[TypeName, MessageCallback]]] = {}
        self._pending_calls: dict[str, tuple[TypeName, MessageCallback, FailureCallback]] = {}
        self._servers: dict[str, tuple[TypeName, RequestHandler]] = {}
        self._actions: dict[str, RosbridgeAction] = {}
        self._deferred_calls: list[Callable[[], None]] = []
        self._connection = RosbridgeConnection(url or DEFAULT_URL)

    # --- the interface of a node --------------------------------------------------------------------------

    def create_publisher(
        self, topic: str, message_type: str, qos: QosProfile = PROFILES["default"]
    ) -> Publisher:
        connection, type_name = self._connection, parse_type(message_type)
        self._definitions.find_fields(type_name)  # raises the error about an unknown type
        op = {
            "op": "advertise",
            "topic": check_ros_name(topic),
            "type": str(type_name),
            "queue_size": qos.depth,
            "latch": qos.durability == "transient_local",
        }
        unadvertise = connection.register(op, {"op": "unadvertise", "topic": topic})

        def publish(message: Mapping[str, Any]) -> None:
            connection.send({"op": "publish", "topic": topic, "msg": self._codec.to_json(type_name, message)})

        # the bridge does not report the number of subscriptions, and counts as one
        return Publisher(publish, lambda: int(connection.is_connected), unadvertise)

    def _subscribe(
        self, topic: str, message_type: str, callback: MessageCallback, qos: QosProfile
    ) -> Callable[[], None]:
        type_name = parse_type(message_type, "msg")
        if _ACTION_INFIX in topic:
            return self._register_action(topic, type_name).subscribe(topic.rpartition("/")[2], callback)
        self._definitions.find_fields(type_name)  # raises the error about an unknown type
        subscription = (type_name, callback)
        self._subscriptions.setdefault(check_ros_name(topic), []).append(subscription)
        op_id = f"subscribe:{topic}:{next(self._ids)}"
        op = {
            "op": "subscribe",
            "id": op_id,
            "topic": topic,
            "type": str(type_name),
            "queue_length": qos.depth,
        }
        unsubscribe = self._connection.register(op, {"op": "unsubscribe", "id": op_id, "topic": topic})

        def end_subscription() -> None:
            if subscription in self._subscriptions[topic]:
                self._subscriptions[topic].remove(subscription)
                unsubscribe()

        return end_subscription

    def create_client(self, service: str, service_type: str) -> Client:
        type_name = parse_type(service_type, "srv")
        if _ACTION_INFIX in service:
            return ActionServiceClient(
                self._connection, self._register_action(service, type_name), service.rpartition("/")[2]
            )
        self._definitions.find_fields(type_name.derive("Request"))  # raises the error about an unknown type
        encode = partial(self._codec.to_json, type_name.derive("Request"))
        return ServiceClient(
            self._connection, encode, partial(self._call_service, check_ros_name(service), type_name)
        )

    def _serve_later(self, service: str, service_type: str, handler: RequestHandler) -> Callable[[], None]:
        if _ACTION_INFIX in service:
            raise Ros2Error(
                "actions are not served over rosbridge", hint="use the transport dds to serve actions"
            )
        type_name = parse_type(service_type, "srv")
        self._definitions.find_fields(type_name.derive("Request"))  # raises the error about an unknown type
        self._servers[check_ros_name(service)] = (type_name, handler)
        op = {"op": "advertise_service", "service": service, "type": str(type_name)}
        unadvertise = self._connection.register(op, {"op": "unadvertise_service", "service": service})

        def end_service() -> None:
            if self._servers.pop(service, None) is not None:
                unadvertise()

        return end_service

    def poll(self, timeout_s: float = 0.0) -> bool:
        deferred_calls, self._deferred_calls = self._deferred_calls, []
        for call in deferred_calls:
            call()
        for action in self._actions.values():
            action.repeat_cancel_requests()
        has_received = bool(deferred_calls)
        for op in self._connection.receive(0.0 if has_received else timeout_s):
            has_received = True
            if op is CONNECTION_LOST:
                self._fail_pending()
            elif (handle := self._handlers.get(op.get("op", ""))) is not None:
                handle(self, op)
        return has_received

    def close(self) -> None:
        self._connection.close()

    # --- incoming messages --------------------------------------------------------------------------------

    def _handle_message(self, op: Operation) -> None:
        for type_name, callback in list(self._subscriptions.get(op.get("topic", ""), ())):
            callback(self._codec.from_json(type_name, op.get("msg")))

    def _handle_response(self, op: Operation) -> None:
        call = self._pending_calls.pop(str(op.get("id")), None)
        if call is None:
            return
        type_name, on_response, on_failure = call
        if op.get("result", True):
            on_response(self._codec.from_json(type_name.derive("Response"), op.get("values")))
        else:
            on_failure(str(op.get("values")))

    def _handle_request(self, op: Operation) -> None:
        server = self._servers.get(op.get("service", ""))
        if server is None:
            return
        type_name, handler = server
        # the bridge assigns the response to the call by these two values
        call_fields = {key: op[key] for key in ("id", "service") if key in op}

        def reply(message: Mapping[str, Any]) -> None:
            values = self._codec.to_json(type_name.derive("Response"), message)
            self._connection.send({**call_fields, "op": "service_response", "values": values, "result": True})

        handler(self._codec.from_json(type_name.derive("Request"), op.get("args")), reply)

    def _handle_status(self, op: Operation) -> None:
        if op.get("level") in ("error", "warning"):
            status_text = str(op.get("msg"))
            # the start of the text names the problem, the rest quotes a message or a line of code
            self.complain(
                f"status {status_text[:_COMPARED_LENGTH]}",
                f"the rosbridge reports: {status_text[:_DISPLAYED_LENGTH]}",
            )

    def _handle_action(self, op: Operation) -> None:
        action = self._actions.get(op.get("action", ""))
        if action is not None:
            action.handle_operation(op, self._codec.from_json)

    def _fail_pending(self) -> None:
        """End all calls and goals as failures, since the bridge forgets them with the connection."""
        calls, self._pending_calls = self._pending_calls, {}
        for _, _, on_failure in calls.values():
            on_failure(_LOST_REASON)
        for action in self._actions.values():
            action.fail_goals(_LOST_REASON)

    _handlers: Final[Mapping[str, Callable[[RosbridgeNode, Operation], None]]] = {
        "publish": _handle_message,
        "service_response": _handle_response,
        "call_service": _handle_request,
        "action_feedback": _handle_action,
        "action_result": _handle_action,
        "status": _handle_status,
    }

    # --- services and actions -----------------------------------------------------------------------------

    def _call_service(
        self,
        service: str,
        type_name: TypeName,
        args: Any,
        on_response: MessageCallback,
        on_failure: FailureCallback,
    ) -> None:
        call_id = str(next(self._ids))
        op = {"op": "call_service", "id": call_id, "service": service, "type": str(type_name), "args": args}
        self._pending_calls[call_id] = (type_name, on_response, on_failure)
        if not self._connection.send(op):
            # deferred, since the caller does not expect a callback before its call returns
            failure = {"id": call_id, "result": False, "values": _UNREACHABLE_REASON}
            self._deferred_calls.append(lambda: self._handle_response(failure))

    def _register_action(self, name: str, type_name: TypeName) -> RosbridgeAction:
        """Return the action to which a topic or service belongs; the first call makes the action.

        :param name: the name of the topic or service.
        :param type_name: the type of the topic or service, from which the action gets its type.
        """
        action_name = name.partition(_ACTION_INFIX)[0]
        if action_name not in self._actions:
            self._actions[action_name] = RosbridgeAction(
                check_ros_name(action_name), self._connection, self._defer, self._send_goal
            )
        action = self._actions[action_name]
        # the types of cancel requests and status messages do not name the action
        if type_name.kind == "action":
            action.type_name = TypeName(type_name.package, "action", type_name.name.partition("_")[0])
        return action

    def _defer(self, call: Callable[[], None]) -> None:
        self._deferred_calls.append(call)

    def _send_goal(self, action: RosbridgeAction, goal_id: str, goal: Mapping[str, Any]) -> bool:
        return self._connection.send(
            {
                "op": "send_action_goal",
                "id": goal_id,
                "action": action.name,
                "action_type": str(action.type_name),
                "args": self._codec.to_json(action.type_name.derive("Goal"), goal),
                "feedback": True,
            }
        )
