"""What a client of the Fawkes port waits that writes as Fawkes' own do: header and payload apart, Nagle on.

    python benchmarks/bench_nagle.py [--seconds N] [--connect HOST:PORT] [--json]

The payload of such a client leaves its machine only when the header is acknowledged, which a kernel may put
off for 40 ms: then Nagle's algorithm and the delayed acknowledgement wait for each other. A bare socket opens
TestInterface for writing, and writes it at a steady pace: from the first byte of the header to the echo of
the write is a round trip. *open* is from the request to open it for reading to OPEN_SUCCESS. The limits are
1.5 ms for the median of a round trip at each pace, and 5 ms for that of opening. With ``--connect`` it
measures what listens there, for example a real Fawkes.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing as mp
import socket
import struct
import sys
import time
from collections.abc import Sequence
from multiprocessing.connection import Connection

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.fawkesnet.messages import blackboard as bb
from cxbridge.blackboard.fawkesnet.messages.codec import limit_to_client
from cxbridge.blackboard.fawkesnet.messages.frames import FawkesFrame, FrameDecoder
from cxbridge.blackboard.fawkesnet.server import FawkesServer
from cxbridge.clock import RealClock
from cxbridge.interfaces import default_registry
from cxbridge.interfaces.known_hashes import hash_for_wire

PACES_MS = (1, 2, 5, 10, 20, 50, 100)
LIMIT_MS = 1.5
OPEN_LIMIT_MS = 5.0
SCHEMA = default_registry().schema("TestInterface")
HEADER = 8  # bytes of a frame before its payload

Report = dict[str, tuple[float, float]]
"""By what was measured: median and 99th percentile, milliseconds."""


class Apart:
    """A client that writes header and payload apart, with Nagle's algorithm on."""

    def __init__(self, host: str, port: int) -> None:
        self._sock = socket.create_connection((host, port))
        self._decoder = FrameDecoder(limit_to_client)
        self._frames: list[FawkesFrame] = []

    def send(self, frame: bytes) -> None:
        self._sock.sendall(frame[:HEADER])
        if len(frame) > HEADER:
            self._sock.sendall(frame[HEADER:])

    def wait(self, kind: int) -> FawkesFrame:
        """Return the next frame of a kind; others are dropped."""
        while True:
            while self._frames:
                frame = self._frames.pop(0)
                if frame.kind == kind:
                    return frame
            data = self._sock.recv(65536)
            if not data:
                raise SystemExit("the server has ended the connection")
            self._frames += self._decoder.feed(data)

    def open(self, *, writing: bool) -> bb.OpenSuccess:
        self.send(bb.Open(SCHEMA.name, "nagle", hash_for_wire(SCHEMA), writing).to_bytes())
        return bb.OpenSuccess.unpack(self.wait(bb.BoardKind.OPEN_SUCCESS).payload)


def serve(pipe: Connection) -> None:
    with FawkesServer(LocalBlackBoard(default_registry(), RealClock()), port=0) as server:
        pipe.send(server.port)
        pipe.recv()


def measure(host: str, port: int, seconds: float) -> Report:
    client = Apart(host, port)
    result: Report = {}
    opened = client.open(writing=True)
    for pace_ms in PACES_MS:
        times = []
        for number in range(max(20, int(min(seconds, 1000 * pace_ms / 1000) * 1000 / pace_ms))):
            block = struct.pack("=qq", number + 1, 0) + opened.block[16:]
            begun = time.perf_counter()
            client.send(bb.data_frame(opened.serial.bytes, block, changed=True))
            client.wait(bb.BoardKind.DATA_CHANGED)
            times.append(time.perf_counter() - begun)
            time.sleep(max(0.0, pace_ms / 1000 - times[-1]))
        result[f"{pace_ms} ms apart"] = summary(times)
    other, times = Apart(host, port), []
    for _ in range(max(20, int(seconds * 20))):
        begun = time.perf_counter()
        reader = other.open(writing=False)
        times.append(time.perf_counter() - begun)
        other.send(bb.Close(reader.serial).to_bytes())
        time.sleep(0.05)
    result["open"] = summary(times)
    return result


def summary(seconds: list[float]) -> tuple[float, float]:
    ordered = sorted(seconds)
    return ordered[len(ordered) // 2] * 1000, ordered[int(len(ordered) * 0.99)] * 1000


def main(arguments: Sequence[str] = ()) -> int:
    """Measure and print; `arguments` are those of the command line."""
    parser = argparse.ArgumentParser(description="round trips of clients that write as Fawkes' own do")
    parser.add_argument("--seconds", type=float, default=3.0, help="for each measurement, about")
    parser.add_argument("--connect", metavar="HOST:PORT", help="a server that runs already")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(arguments)
    pipe, far = mp.Pipe()
    host, port = "127.0.0.1", 0
    if options.connect:
        host, _, number = options.connect.rpartition(":")
        port = int(number)
    else:
        mp.Process(target=serve, args=(far,), daemon=True).start()
        port = pipe.recv()
    result = measure(host, port, options.seconds)
    pipe.send(None)
    if options.json:
        print(json.dumps(result, indent=1))
    else:
        for what, (median, worst) in result.items():
            print(f"{what:15} p50 {median:7.3f} ms  p99 {worst:7.3f} ms")
    slow = [w for w, (median, _) in result.items() if median > (OPEN_LIMIT_MS if w == "open" else LIMIT_MS)]
    print("TOO SLOW: " + ", ".join(slow) if slow else "within the limits: 1.5 ms, opening 5 ms")
    return 1 if slow else 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
