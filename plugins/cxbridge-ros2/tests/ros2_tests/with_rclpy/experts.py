"""Asks services with rclpy: a line of JSON on stdin is one request, a line on stdout its response."""

from __future__ import annotations

import json
import sys

import rclpy
from rosidl_runtime_py import message_to_ordereddict, set_message_fields
from rosidl_runtime_py.utilities import get_service

PATIENCE_S = 20.0


def tell(line: str) -> None:
    print(line, flush=True)  # noqa: T201


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("stranger")
    clients = {}
    tell("ready")
    for line in sys.stdin:
        name, kind, values = json.loads(line)
        service = get_service(kind)
        if name not in clients:
            clients[name] = node.create_client(service, name)
        client = clients[name]
        if not client.wait_for_service(PATIENCE_S):
            tell("null")
            continue
        request = service.Request()
        set_message_fields(request, values)
        future = client.call_async(request)
        rclpy.spin_until_future_complete(node, future, timeout_sec=PATIENCE_S)
        found = future.result() if future.done() else None
        tell(json.dumps(None if found is None else message_to_ordereddict(found)))


main()
