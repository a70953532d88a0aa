"""Output of the messages of a skill board, for ``cxbridge trace exchange``.

A skill board assigns skills to executors by messages, as in the ROS 2 CLIPS Executive of 2021; see
docs/skill-board.md. The master is the client of the skill board that requests the skill.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict

from cxbridge.clock import MICROSECONDS
from cxbridge.events import Event
from cxbridge.history.exchange import ExchangeReader, SkillMessage


def exchange_lines(events: Iterable[Event]) -> Iterator[str]:
    """Yield a line per message: seconds since the first message, type, route, content.

    The route begins with the master; its arrow points to the receiver.
    """
    start_us: int | None = None
    for message, master in ExchangeReader().read(events):
        start_us = message.time_us if start_us is None else start_us
        seconds = (message.time_us - start_us) / MICROSECONDS
        yield f"{seconds:9.3f}  {message.type:8}  {_route_text(message, master)}{_content_text(message)}"


def exchange_json_lines(events: Iterable[Event]) -> Iterator[str]:
    """Yield a JSON object per message, with the fields of the topic in the ROS 2 CLIPS Executive of 2021.

    The further field ``t`` is the time in seconds since the epoch.
    """
    for message, _master in ExchangeReader().read(events):
        fields = asdict(message)
        del fields["request"]  # a field of the recording, not of the topic
        fields = {"t": fields.pop("time_us") / MICROSECONDS, **fields}
        yield json.dumps(fields, ensure_ascii=False)


def _route_text(message: SkillMessage, master: str) -> str:
    if message.type == "REQUEST":
        return f"{master} -> all"
    if message.type in ("RESPONSE", "FEEDBACK", "FINISH"):
        return f"{master} <- {message.node_id}"
    return f"{master} -> {message.node_id}"


def _content_text(message: SkillMessage) -> str:
    if message.type == "REQUEST":
        mapping_text = f", mapped to {message.mapped_action}" if message.mapped_action else ""
        return f": {' '.join((message.action, *message.params))}, agent {message.agent_id}{mapping_text}"
    if message.type not in ("FEEDBACK", "FINISH"):
        return ""
    outcome = "" if message.type == "FEEDBACK" else "success " if message.success else "failure "
    return f": {outcome}{message.progress:.0%} {message.status}".rstrip()
