"""Recorded conversations of Fawkes' clients with Fawkes, in the recorded order."""

from __future__ import annotations

import re
from dataclasses import dataclass
from uuid import UUID

from cxbridge_fawkes.network.messages import codec
from cxbridge_fawkes.network.messages.codec import client_payload_limit
from cxbridge_fawkes.network.messages.frames import FawkesFrame, FrameDecoder
from tests.support import SHARED

TRACES = SHARED / "traces" / "network"

_LINE = re.compile(
    r"\d+\.\d+ conn(?P<conn>\d+) "
    r"(?:(?P<dir>C->S|S->C) (?:cid=(?P<cid>\d+)\S+ msgid=(?P<kind>\d+)|(?P<fin>FIN))|(?P<syn>SYN))"
)

NO_FRAME = FawkesFrame(0, 0)


@dataclass(frozen=True)
class Step:
    """A step of a conversation.

    :param conn: the number of the connection.
    :param action: ``connect``, ``disconnect`` (by the client), ``request`` (to the server) or ``answer``.
    """

    conn: int
    action: str
    frame: FawkesFrame = NO_FRAME

    @property
    def message(self):
        return codec.decode(self.frame)


def frames_of(data: bytes) -> list[FawkesFrame]:
    decoder = FrameDecoder(client_payload_limit)
    frames = list(decoder.feed(data))
    assert decoder.pending_size == 0
    return frames


def load(name: str) -> list[Step]:
    """Return the steps of a recording."""
    waiting = {}
    for path in TRACES.glob(f"{name}.conn*.bin"):
        _, number, direction, _ = path.name.split(".")
        waiting[int(number.removeprefix("conn")), direction] = iter(frames_of(path.read_bytes()))
    steps = []
    for line in (TRACES / f"{name}.decoded.txt").read_text().splitlines():
        match = _LINE.match(line)
        if match is None:
            continue
        conn = int(match["conn"])
        if match["syn"]:
            steps.append(Step(conn, "connect"))
        elif match["fin"]:
            if match["dir"] == "C->S":
                steps.append(Step(conn, "disconnect"))
        else:
            is_request = match["dir"] == "C->S"
            frame = next(waiting[conn, "c2s" if is_request else "s2c"])
            assert (frame.component, frame.kind) == (int(match["cid"]), int(match["kind"]))
            steps.append(Step(conn, "request" if is_request else "answer", frame))
    assert all(next(rest, None) is None for rest in waiting.values())
    return steps


class SerialMap:
    """Maps recorded serials to those of the test, as bytes and as text."""

    def __init__(self) -> None:
        self._pairs: list[tuple[bytes, bytes]] = []

    def learn(self, recorded: UUID, actual: UUID) -> None:
        self._pairs.append((recorded.bytes, actual.bytes))
        self._pairs.append((str(recorded).encode(), str(actual).encode()))

    def translate(self, frame: FawkesFrame) -> FawkesFrame:
        """Return a recorded frame with the serials of the test."""
        payload = frame.payload
        for recorded, actual in self._pairs:
            payload = payload.replace(recorded, actual)
        return frame._replace(payload=payload)
