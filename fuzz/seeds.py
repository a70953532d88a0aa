"""Inputs to begin with: one of each kind of message, so that a fuzzer need not find the forms itself."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

from cxbridge.blackboard.zmq.wire.codec import SESSION_SIZE, Envelope
from cxbridge.blackboard.zmq.wire.dataframes import (
    VERSION,
    AnswerBody,
    CreditBody,
    DeliverBody,
    DeliveredBody,
    SendBody,
    UpdateBody,
    WriteBody,
    ZmqFrame,
)
from fuzz.sessions import SCRIPTS
from fuzz.skills import SKILL_STRINGS
from fuzz.targets import join_message, repack

_SCALARS: dict[str, Any] = {"int": 7, "bool": True, "bytes": bytes(range(SESSION_SIZE)), "str": "Type"}


def zmq_seeds() -> Iterator[bytes]:
    """Yield each kind of envelope, empty and with all its fields, without and with a block; data frames."""
    for field in Envelope.DESCRIPTOR.oneofs_by_name["body"].fields:
        for full in (False, True):
            filled = Envelope(version=VERSION, number=1)
            body = getattr(filled, field.name)
            body.SetInParent()
            if full:
                _fill(body)
            data = filled.SerializeToString()
            yield join_message([data])
            yield join_message([data, bytes(24)])
    serial = bytes(range(SESSION_SIZE))
    for body in (
        WriteBody(serial, 2, True),
        UpdateBody(1, 2, True, False, 3),
        CreditBody(64),
        SendBody(1, serial, serial, "Type", 7, "thread", 1),
        DeliverBody(1, serial, serial, serial, "Type", 7, "thread", 1),
        DeliveredBody(1, 7, 1024),
        AnswerBody(1, 18, 0, "text"),
    ):
        frame = repack(ZmqFrame("", body, 1, bytes(24)))
        yield join_message([frame])
        yield join_message([frame[:-25]])


def _fill(message: Any) -> None:
    """Give each field of a message a value."""
    for field in message.DESCRIPTOR.fields:
        if field.message_type is not None:
            value = getattr(message, field.name)
            _fill(value.add() if hasattr(value, "add") else value)
        elif hasattr(getattr(message, field.name), "append"):
            getattr(message, field.name).append("reader")
        else:
            setattr(message, field.name, _SCALARS.get(type(getattr(message, field.name)).__name__, 1))


def fawkesnet_seeds() -> Iterator[bytes]:
    """Yield each kind of frame with payloads of the sizes that occur, and two that are wrong."""
    from cxbridge.blackboard.fawkesnet.messages import blackboard as bb  # noqa: PLC0415
    from tests.blackboard.fawkesnet.samples import SAMPLES  # noqa: PLC0415 - not where tests are absent

    for message in SAMPLES.values():
        yield b"\0" + message.to_bytes()
        yield b"\x07" + message.to_bytes() * 2
    yield b"\x01" + bb.ListAll().to_bytes() + b"\0\2\0\1\xff\xff\xff\xff"
    yield b"\x03" + b"\0\x63\0\1\0\0\0\1x"


def _ros2_seeds() -> Iterator[bytes]:
    from fuzz.ros2 import cdr_seeds  # noqa: PLC0415 - an extra

    yield from cdr_seeds()


SEEDS: Final[dict[str, Callable[[], Iterator[bytes]]]] = {
    "zmq": zmq_seeds,
    "zmq-sessions": lambda: iter(SCRIPTS),
    "fawkesnet": fawkesnet_seeds,
    "skill-strings": lambda: iter(SKILL_STRINGS),
    "ros2-cdr": _ros2_seeds,
}


def write_seeds(name: str, folder: Path) -> None:
    """Write the seeds of a target into a folder, each under the hash of its content."""
    folder.mkdir(parents=True, exist_ok=True)
    for seed in SEEDS[name]():
        (folder / hashlib.sha1(seed, usedforsecurity=False).hexdigest()).write_bytes(seed)
