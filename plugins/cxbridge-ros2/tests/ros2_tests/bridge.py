"""A rosbridge for tests: the part of the protocol that cxbridge's client uses, on a node of cxbridge.

::

    python -m ros2_tests.bridge PORT
"""

from __future__ import annotations

import json
import queue
import sys
import threading
from collections.abc import Callable
from typing import Any

from websockets.sync.server import ServerConnection, serve

from cxbridge_ros2.actions import ActionClient, GoalStatus, SentGoal
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.node import Client, Publisher
from cxbridge_ros2.qos import QosProfile
from cxbridge_ros2.transports.dds import DdsNode
from ros2_tests.peer import PACKAGES

DEEP = QosProfile(depth=300)


class Bridge:
    """The subscriptions, clients and goals of a rosbridge. Only the polling thread uses them."""

    def __init__(self) -> None:
        self.inbox: queue.SimpleQueue[tuple[ServerConnection, dict[str, Any]]] = queue.SimpleQueue()
        self._node = DdsNode("bridge", Definitions([PACKAGES], environment={}))
        self._publishers: dict[str, Publisher] = {}
        self._clients: dict[str, Client] = {}
        self._actions: dict[str, ActionClient] = {}
        self._goals: dict[str, tuple[ServerConnection, dict[str, Any], SentGoal, list[Any]]] = {}
        self._replies: dict[str, Callable[[Any], None]] = {}
        self._ends: dict[str, Callable[[], None]] = {}
        self._subscribed: dict[tuple[ServerConnection, str], tuple[set[str], Callable[[], None]]] = {}

    def loop(self) -> None:
        self._node.poll(0.005)
        while not self.inbox.empty():
            socket, op = self.inbox.get()
            getattr(self, op["op"])(socket, op)
        for number, (socket, op, sent, last_feedback) in list(self._goals.items()):
            head = {"id": number, "action": op["action"]}
            if sent.feedback is not None and sent.feedback is not last_feedback[0]:
                last_feedback[0] = sent.feedback
                send(socket, {**head, "op": "action_feedback", "values": sent.feedback})
            if sent.is_over:
                del self._goals[number]
                result = {**head, "op": "action_result", "result": True, "values": sent.result}
                if sent.is_accepted is False:
                    result |= {"result": False, "values": "Action goal was rejected"}
                send(socket, {**result, "status": sent.status})

    def advertise(self, _socket: ServerConnection, op: dict[str, Any]) -> None:
        self._publishers[op["topic"]] = self._node.create_publisher(op["topic"], op["type"], DEEP)

    def publish(self, _socket: ServerConnection, op: dict[str, Any]) -> None:
        self._publishers[op["topic"]].publish(op["msg"])

    def unadvertise(self, _socket: ServerConnection, op: dict[str, Any]) -> None:
        self._publishers.pop(op["topic"]).close()

    def subscribe(self, socket: ServerConnection, op: dict[str, Any]) -> None:
        """Subscribe once for all ids of a client and a topic, like the real rosbridge."""

        def receive(message: Any) -> None:
            send(socket, {"op": "publish", "topic": op["topic"], "msg": message})

        ids, end = self._subscribed.get((socket, op["topic"]), (set(), None))
        end = end or self._node.subscribe(op["topic"], op["type"], receive, DEEP)
        self._subscribed[socket, op["topic"]] = (ids | {op["id"]}, end)

    def unsubscribe(self, socket: ServerConnection, op: dict[str, Any]) -> None:
        ids, end = self._subscribed.pop((socket, op["topic"]))
        if ids == {op["id"]}:
            end()
        else:
            self._subscribed[socket, op["topic"]] = (ids - {op["id"]}, end)

    def call_service(self, socket: ServerConnection, op: dict[str, Any]) -> None:
        client = self._clients.get(op["service"]) or self._node.create_client(op["service"], op["type"])
        self._clients[op["service"]] = client
        head = {"op": "service_response", "id": op["id"], "service": op["service"]}
        if op["service"] == "/missing":
            send(socket, {**head, "result": False, "values": "Service /missing does not exist"})
            return
        while not client.has_server:
            self._node.poll(0.05)
        client.call(op["args"], lambda each: send(socket, {**head, "values": each, "result": True}))

    def advertise_service(self, socket: ServerConnection, op: dict[str, Any]) -> None:
        def answer(request: Any, reply: Callable[[Any], None]) -> None:
            number = f"call{len(self._replies)}"
            self._replies[number] = reply
            send(socket, {"op": "call_service", "id": number, "service": op["service"], "args": request})

        self._ends[op["service"]] = self._node.serve_later(op["service"], op["type"], answer)

    def unadvertise_service(self, _socket: ServerConnection, op: dict[str, Any]) -> None:
        self._ends.pop(op["service"])()

    def service_response(self, _socket: ServerConnection, op: dict[str, Any]) -> None:
        self._replies.pop(op["id"])(op["values"])

    def send_action_goal(self, socket: ServerConnection, op: dict[str, Any]) -> None:
        name = op["action"]
        client = self._actions.get(name) or ActionClient(self._node, name, op["action_type"])
        self._actions[name] = client
        while not client.has_server:
            self._node.poll(0.05)
        self._goals[op["id"]] = socket, op, client.send(op["args"]), [None]

    def cancel_action_goal(self, _socket: ServerConnection, op: dict[str, Any]) -> None:
        if (
            op["id"] in self._goals and self._goals[op["id"]][2].is_accepted
        ):  # the real rosbridge ignores earlier cancels
            self._goals[op["id"]][2].cancel()


def send(socket: ServerConnection, op: dict[str, Any]) -> None:
    socket.send(json.dumps({**op, "status": int(op.get("status", GoalStatus.UNKNOWN))}, default=list))


def main() -> None:
    bridge = Bridge()

    def talk(socket: ServerConnection) -> None:
        for text in socket:
            bridge.inbox.put((socket, json.loads(text)))

    with serve(talk, "127.0.0.1", int(sys.argv[1])) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        while True:
            bridge.loop()


if __name__ == "__main__":
    main()
