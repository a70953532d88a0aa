"""The seeds of the targets: valid and nearly valid inputs, so that the fuzzer need not find their forms."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from cxbridge.blackboard.info import InterfaceInfo
from cxbridge.blackboard.listeners import EventKind
from cxbridge.blackboard.zmq.wire import frames
from cxbridge.blackboard.zmq.wire.frames import SERIAL_SIZE, Frame, ResultCode
from fuzz.sessions import SCRIPTS
from fuzz.skills import SKILL_STRINGS

_SERIAL: Final = bytes(range(SERIAL_SIZE))
_BLOCK: Final = bytes(24)
_INFO: Final = InterfaceInfo("Type", "id", _SERIAL, 1, True, "writer", ("reader",), 7)

ZMQ_FRAMES: Final[tuple[Frame, ...]] = (
    frames.Hello(_SERIAL, name="client"),
    frames.Open("Type", "id", _SERIAL, 24, "owner", True, request=1, number=1),
    frames.Close(_SERIAL, request=1),
    frames.List("*", "[a"),
    frames.Watch(request=2**64 - 1),
    frames.Sync(),
    frames.Send(_SERIAL, _SERIAL, "Type", 7, "thread", 2**32 - 1, _BLOCK),
    frames.Write(_SERIAL, None, True, _BLOCK),
    frames.Credit(64),
    frames.Delivered(1, ResultCode.QUEUE_FULL, 1024),
    frames.Beat(),
    frames.Bye(),
    frames.Welcome(_SERIAL, 50, 1024),
    frames.Reply(ResultCode.VERSION_MISMATCH, 1, "text", _SERIAL, request=1),
    frames.Opened(_SERIAL, 1, 2, True, False, [frames.Member(_SERIAL, "owner", True)], None, request=1),
    frames.Listed([_INFO], request=1),
    frames.Update(1, 2, True, False, 3, _BLOCK),
    frames.Change(1, EventKind.READER_ADDED, _SERIAL, "owner"),
    frames.Deliver(_SERIAL, _SERIAL, _SERIAL, "Type", 7, "thread", 1, _BLOCK),
    frames.Existence(True, "Type", "id"),
    frames.Gone(ResultCode.SHUTDOWN, "text"),
)
"""A frame of each kind."""


def zmq_seeds() -> Iterator[bytes]:
    """Yield a frame of each kind, complete and truncated."""
    for frame in ZMQ_FRAMES:
        encoded_frame = frames.encode(frame)
        yield encoded_frame
        yield encoded_frame[:-1]


def _fawkes_seeds() -> Iterator[bytes]:
    from fuzz.fawkes import fawkes_seeds  # noqa: PLC0415 - the plug-in may be missing

    yield from fawkes_seeds()


def _ros2_seeds() -> Iterator[bytes]:
    from fuzz.ros2 import cdr_seeds  # noqa: PLC0415 - the plug-in may be missing

    yield from cdr_seeds()


SEEDS: Final[dict[str, Callable[[], Iterator[bytes]]]] = {
    "zmq": zmq_seeds,
    "zmq-sessions": lambda: iter(SCRIPTS),
    "fawkesnet": _fawkes_seeds,
    "skill-strings": lambda: iter(SKILL_STRINGS),
    "ros2-cdr": _ros2_seeds,
}


def write_seeds(name: str, folder: Path) -> None:
    """Write the seeds of a target into a folder; the name of a file is the hash of its content."""
    folder.mkdir(parents=True, exist_ok=True)
    for seed in SEEDS[name]():
        (folder / hashlib.sha1(seed, usedforsecurity=False).hexdigest()).write_bytes(seed)
