"""Decode and encode CDR messages with the real rclpy; the result is null for types that rclpy lacks."""

import json
import sys
from importlib import import_module

from rclpy.serialization import deserialize_message, serialize_message


def reencode(name, data):
    package, _, kind = name.split("/")
    try:
        message = getattr(import_module(f"{package}.msg"), kind)
    except (ImportError, AttributeError):
        return None
    return serialize_message(deserialize_message(bytes.fromhex(data), message)).hex()


print(json.dumps([reencode(*each) for each in json.load(sys.stdin)]))  # noqa: T201
