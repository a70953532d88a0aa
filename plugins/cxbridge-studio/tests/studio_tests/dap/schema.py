"""Prints the arguments of the requests of the debug adapter protocol: requests.json is made of it.

``python -m studio_tests.dap.schema debugAdapterProtocol.json`` prints requests.json: the schema is the one
that the protocol publishes. Of each request a client can send: names, JSON types and parts of its arguments.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

Definitions = Mapping[str, Any]
_OF_ADAPTERS = ("runInTerminal", "startDebugging")  # reverse requests: a client answers them


def _merged(known: Definitions, node: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """Return properties and required ones of a schema, with those it is built on."""
    properties: dict[str, Any] = {}
    required: list[str] = []
    for part in node.get("allOf", [node]):
        if "$ref" in part:
            more, needed = _merged(known, _referred(known, part))
        else:
            more, needed = part.get("properties", {}), part.get("required", [])
        properties |= more
        required += needed
    return properties, required


def _referred(known: Definitions, node: Mapping[str, Any]) -> Mapping[str, Any]:
    return known[node["$ref"].rpartition("/")[2]] if "$ref" in node else node


def _shape(known: Definitions, node: Mapping[str, Any], depth: int = 0) -> dict[str, Any]:
    """Return a type: its JSON type, values, parts and items, as far as it has them."""
    node = _referred(known, node)
    kinds = node.get("type", "object")
    found: dict[str, Any] = {"type": kinds if isinstance(kinds, str) else "any"}
    if "enum" in node:
        found["enum"] = node["enum"]
    if found["type"] == "array":
        found["items"] = _shape(known, node["items"], depth + 1)
    properties, required = _merged(known, node)
    if properties and depth < 3:
        found["parts"] = {name: _shape(known, each, depth + 1) for name, each in properties.items()}
        found["required"] = sorted(set(required))
    return found


def requests(known: Definitions) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the requests that clients send, and their arguments."""
    for name, node in known.items():
        if name.endswith("Request") and name != "Request":
            properties, _ = _merged(known, node)
            command = properties["command"]["enum"][0]
            if command not in _OF_ADAPTERS:
                yield command, _shape(known, properties.get("arguments", {"type": "object"}))


if __name__ == "__main__":
    schema = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    rows = (f"{json.dumps(name)}: {json.dumps(shape)}" for name, shape in requests(schema["definitions"]))
    sys.stdout.write("{\n" + ",\n".join(rows) + "\n}\n")
