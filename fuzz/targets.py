"""The targets: each target takes any bytes, and fails by an exception.

Targets are plain functions for the fuzzer (``python -m fuzz``), and for the tests, which replay its findings.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from typing import Final

from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.zmq.wire import frames
from fuzz.sessions import zmq_sessions
from fuzz.skills import skill_strings


def zmq_frame(data: bytes) -> None:
    """Decode a frame; an accepted frame must survive encoding and decoding."""
    for decode in (frames.decode_client_frame, frames.decode_server_frame):
        try:
            frame = decode(data)
        except ProtocolError:
            continue
        decoded = decode(frames.encode(frame))
        assert decoded == frame, f"{frame} changed to {decoded}"


# targets by their names on the command line
TARGETS: Final[dict[str, Callable[[bytes], None]]] = {
    "zmq": zmq_frame,
    "zmq-sessions": zmq_sessions,
    "skill-strings": skill_strings,
}
if find_spec("cxbridge_fawkes"):
    from fuzz.fawkes import fawkes_stream

    TARGETS["fawkesnet"] = fawkes_stream
