"""1,000 messages a second between two peers on UDP, encrypted with AES as the league's, beside plain ones."""

from __future__ import annotations

import socket
import statistics
import tempfile
import time
from pathlib import Path

from benchmarks.harness import report
from cxbridge_protobuf.inbox import Received
from cxbridge_protobuf.network import Network
from cxbridge_protobuf.settings import NetworkSettings
from cxbridge_protobuf.types import MessageTypes, frame_of

RATE = 1000
SECONDS = 5
ROUNDS = 5
LIMIT = 1.5
AES = "aes-128-cbc"
MESSAGE = """
syntax = "proto2";
package bench;
message Beacon { enum CompType { COMP_ID = 1; MSG_TYPE = 2; }
  required uint32 number = 1; required string text = 2; }
"""


def free_port() -> int:
    """Return a UDP port that nobody has."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


def now_us() -> int:
    """Return a time."""
    return time.monotonic_ns() // 1000


def play(types: MessageTypes, cipher: str) -> tuple[int, float]:
    """Send for some seconds; return how many messages came, and the share of a core that both sides took."""
    one, other = free_port(), free_port()
    sender, receiver = (Network(types, NetworkSettings(), now_us) for _ in range(2))
    try:
        peer = sender.create_peer("127.0.0.1", one, other, "secret", cipher)
        receiver.create_peer("127.0.0.1", other, one, "secret", cipher)
        message = types.create("bench.Beacon")
        message.text = "x" * 400
        came, begun, cpu = 0, time.monotonic(), time.process_time()
        for number in range(RATE * SECONDS):
            message.number = number
            sender.broadcast(peer, frame_of(message))
            came += sum(isinstance(event, Received) for event in receiver.drain())
            time.sleep(max(0.0, begun + (number + 1) / RATE - time.monotonic()))
        share = (time.process_time() - cpu) / (time.monotonic() - begun)
        time.sleep(0.2)
        return came + sum(isinstance(event, Received) for event in receiver.drain()), share
    finally:
        sender.close()
        receiver.close()


def main() -> None:
    """Send both kinds in turn."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "bench.proto").write_text(MESSAGE)
        types = MessageTypes(print)
        types.add_folders((Path(folder),))
        rounds = [(play(types, AES), play(types, "")) for _ in range(ROUNDS)]
    for name, found in (("AES", [each[0] for each in rounds]), ("plain", [each[1] for each in rounds])):
        share = statistics.median(share for _, share in found)
        lost = RATE * SECONDS * ROUNDS - sum(came for came, _ in found)
        print(f"  {name}: {RATE} messages a second, {lost} lost, {share:.1%} of a core for both sides")
    report("AES to plain", statistics.median(aes[1] / plain[1] for aes, plain in rounds), LIMIT)


if __name__ == "__main__":
    main()
