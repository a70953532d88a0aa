"""The blackboard over ZeroMQ against bare pyzmq: same processes, same payload, in turns, in one run.

::

    python -m benchmarks.bench_zmq [ROUNDS]

Bare means: the writer's DEALER, a daemon that passes the bytes from its ROUTER to its PUB, the readers' SUB.
Ours does all that the protocol promises on top. Times are taken with the machine's monotonic clock, which
processes share.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

import zmq

from cxbridge.blackboard import EventKind, Listener, LocalBlackBoard
from cxbridge.blackboard.zmq import ZmqBlackBoard, ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.interfaces import InterfaceRegistry

TYPE, ID = "SkillerInterface", "bench"
SIZE = 1216  # bytes of SkillerInterface's block
READERS, RATE, SECONDS = 10, 1000, 3.0
BURST = 30_000
STILL = 0.05  # seconds that are told of
TRIPS = 1500


def percentile(values: list[float], share: float) -> float:
    """Return the value below which ``share`` of all lie."""
    return sorted(values)[min(len(values) - 1, int(len(values) * share))]


def tell(result: Any) -> None:
    """Hand a result to the parent."""
    print(json.dumps(result), flush=True)


def pace(rate: float, seconds: float, work: Callable[[], object]) -> None:
    """Call ``work`` at a rate."""
    start = time.monotonic()
    for count in range(int(rate * seconds)):
        left = start + count / rate - time.monotonic()
        if left > 0:
            time.sleep(left)
        work()


def until_told() -> None:
    """Wait for a line from the parent."""
    sys.stdin.readline()


# -- ours


def ours_daemon(url: str, _: str) -> None:
    with ZmqBlackBoardServer(LocalBlackBoard(InterfaceRegistry(), RealClock()), [url]) as server:
        tell(server.endpoints)
        until_told()


def board_at(url: str) -> ZmqBlackBoard:
    return ZmqBlackBoard(url, InterfaceRegistry(), RealClock())


class _Arrivals(Listener):
    def __init__(self) -> None:
        self.delays: list[float] = []
        self.last = 0.0

    def data_refreshed(self, interface: Any) -> None:
        interface.read()
        now = time.monotonic_ns()
        self.delays.append((now - int(interface.error)) / 1e3)
        self.last = now / 1e9


def ours_reader(url: str, _: str) -> None:
    with board_at(url) as board:
        arrivals = _Arrivals()
        reader = board.open_for_reading(TYPE, ID)
        board.register_listener(arrivals, reader, EventKind.DATA_REFRESHED)
        tell("ready")
        until_told()
        board.flush()
        tell(
            {
                "delays": arrivals.delays,
                "last": arrivals.last,
                "skipped": board.skipped,
                "cpu": time.process_time(),
            }
        )
        until_told()


def ours_writer(url: str, mode: str) -> None:
    with board_at(url) as board:
        writer: Any = board.open_for_writing(TYPE, ID)

        def write() -> None:
            writer.error = str(time.monotonic_ns())
            writer.write()

        tell("ready")
        until_told()
        first = time.monotonic()
        if mode == "burst":
            for _ in range(BURST):
                write()
        else:
            pace(RATE, SECONDS, write)
        board.flush()
        tell({"first": first})
        until_told()


class _Answers(Listener):
    def message_received(self, interface: Any, message: Any) -> bool:
        interface.error = message.skill_string
        interface.write()
        return False  # answered: the queue, which is bounded, need not hold it


def ours_worker(url: str, _: str) -> None:
    with board_at(url) as board:
        board.register_listener(_Answers(), board.open_for_writing(TYPE, ID), EventKind.MESSAGE_RECEIVED)
        tell("ready")
        until_told()


class _Waits(Listener):
    def __init__(self) -> None:
        self.there = threading.Event()

    def data_refreshed(self, interface: Any) -> None:
        interface.read()
        self.there.set()


def ours_asker(url: str, _: str) -> None:
    with board_at(url) as board:
        reader: Any = board.open_for_reading(TYPE, ID)
        waits = _Waits()
        board.register_listener(waits, reader, EventKind.DATA_REFRESHED)
        trips = []
        for count in range(TRIPS):
            waits.there.clear()
            message = reader.create_message("ExecSkillMessage")
            message.skill_string = str(count)
            start = time.monotonic_ns()
            reader.msgq_enqueue(message)
            assert waits.there.wait(5)
            trips.append((time.monotonic_ns() - start) / 1e3)
        tell(trips)
        until_told()


# -- bare


def _socket(kind: int, url: str, *, bind: bool = False) -> Any:
    socket: Any = zmq.Context.instance().socket(kind)
    socket.linger = 0
    socket.sndhwm = socket.rcvhwm = 100_000
    if kind == zmq.SUB:
        socket.subscribe = b""
    if bind:
        socket.bind(url)
    else:
        socket.connect(url)
    return socket


def _pub_of(url: str) -> str:
    """Return where the PUB beside a ROUTER is bound."""
    return url if url.endswith("*") else f"{url}.pub"


def bare_daemon(url: str, _: str) -> None:
    router, pub = _socket(zmq.ROUTER, url, bind=True), _socket(zmq.PUB, _pub_of(url), bind=True)
    bound = [one.last_endpoint.decode() for one in (router, pub)]
    tell([" ".join(bound)])
    peers: set[bytes] = set()
    poller: Any = zmq.Poller()
    poller.register(router, zmq.POLLIN)
    poller.register(sys.stdin, zmq.POLLIN)
    while sys.stdin.fileno() not in dict(poller.poll()):
        for _turn in range(64):
            try:
                peer, kind, block = router.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                break
            if kind == b"worker":
                peers.add(peer)
            elif kind == b"ask":
                router.send_multipart([next(iter(peers)), kind, block])
            else:
                pub.send(block)


def bare_reader(url: str, _: str) -> None:
    sub = _socket(zmq.SUB, url.rpartition(" ")[2])
    delays, last = [], 0.0
    tell("ready")
    poller = zmq.Poller()
    poller.register(sub, zmq.POLLIN)
    poller.register(sys.stdin, zmq.POLLIN)
    while True:
        ready = dict(poller.poll())
        if sub in ready:
            block = sub.recv()
            now = time.monotonic_ns()
            delays.append((now - int(block[:20])) / 1e3)
            last = now / 1e9
        elif ready:
            break
    until_told()
    tell({"delays": delays, "last": last, "skipped": 0, "cpu": time.process_time()})
    until_told()


def bare_writer(url: str, mode: str) -> None:
    dealer = _socket(zmq.DEALER, url.partition(" ")[0])

    def write() -> None:
        dealer.send_multipart([b"write", str(time.monotonic_ns()).encode().ljust(SIZE)])

    tell("ready")
    until_told()
    first = time.monotonic()
    if mode == "burst":
        for _ in range(BURST):
            write()
    else:
        pace(RATE, SECONDS, write)
    time.sleep(0.5)
    tell({"first": first})
    until_told()


def bare_worker(url: str, _: str) -> None:
    dealer = _socket(zmq.DEALER, url.partition(" ")[0])
    dealer.send_multipart([b"worker", b""])
    tell("ready")
    poller = zmq.Poller()
    poller.register(dealer, zmq.POLLIN)
    poller.register(sys.stdin, zmq.POLLIN)
    while sys.stdin.fileno() not in dict(poller.poll()):
        dealer.send_multipart([b"write", dealer.recv_multipart()[1]])


def bare_asker(url: str, _: str) -> None:
    dealer, sub = _socket(zmq.DEALER, url.partition(" ")[0]), _socket(zmq.SUB, url.rpartition(" ")[2])
    time.sleep(0.5)
    trips = []
    for count in range(TRIPS):
        start = time.monotonic_ns()
        dealer.send_multipart([b"ask", str(count).encode().ljust(SIZE)])
        assert sub.poll(5000)
        sub.recv()
        trips.append((time.monotonic_ns() - start) / 1e3)
    tell(trips)
    until_told()


# -- the parent


class StoodStill:
    """How long a thread that wants to run every 2 ms had to wait at most meanwhile: what the machine adds."""

    def __enter__(self) -> Self:
        self.longest_s = 0.0
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._look)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()

    def _look(self) -> None:
        before = time.monotonic()
        while not self._end.wait(0.002):
            now = time.monotonic()
            self.longest_s = max(self.longest_s, now - before - 0.002)
            before = now


class Troupe:
    """Child processes that play parts; the daemon first."""

    def __init__(self, kind: str, transport: str, folder: str) -> None:
        self._kind = kind
        self._children: list[subprocess.Popen[str]] = []
        number = len(list(Path(folder).iterdir()))
        Path(folder, str(number)).touch()
        url = "tcp://127.0.0.1:*" if transport == "tcp" else f"ipc://{folder}/s{number}"
        self.url = url
        daemon = self.start("daemon")
        self.url = self.hear(daemon)[0]

    def start(self, part: str, mode: str = "") -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "benchmarks.bench_zmq", f"{self._kind}_{part}", self.url, mode]
        child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self._children.append(child)
        return child

    def hear(self, child: subprocess.Popen[str]) -> Any:
        assert child.stdout is not None
        return json.loads(child.stdout.readline())

    def say(self, child: subprocess.Popen[str]) -> None:
        assert child.stdin is not None
        child.stdin.write("\n")
        child.stdin.flush()

    def cpu_seconds(self) -> float:
        """Return the CPU time that the daemon has used."""
        with open(f"/proc/{self._children[0].pid}/stat") as stat:  # noqa: PTH123
            fields = stat.read().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def memory_mb(self) -> float:
        """Return the memory that the daemon has."""
        with open(f"/proc/{self._children[0].pid}/statm") as statm:  # noqa: PTH123
            return int(statm.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6

    def end(self) -> None:
        for child in reversed(self._children):
            child.communicate("\n\n\n")


def updates(
    kind: str, transport: str, folder: str, readers: int, mode: str
) -> tuple[list[float], float, int]:
    """Return the delays at all readers in microseconds, updates a second, and how many were skipped."""
    troupe = Troupe(kind, transport, folder)
    try:
        children = [troupe.start("reader") for _ in range(readers)]
        writer = troupe.start("writer", mode)
        for child in (*children, writer):
            troupe.hear(child)
        time.sleep(0.3)
        with StoodStill() as still:
            troupe.say(writer)
            first = troupe.hear(writer)["first"]
        time.sleep(0.2)
        for child in children:
            troupe.say(child)
        results = [troupe.hear(child) for child in children]
    finally:
        troupe.end()
    delays = [delay for result in results for delay in result["delays"]]
    last = max(result["last"] for result in results)
    rate = len(results[0]["delays"]) / (last - first)
    skipped = sum(result["skipped"] for result in results)
    if mode == "paced" and (skipped or still.longest_s > STILL):
        print(f"{kind}: {skipped} conflated, the machine stood still for {still.longest_s:.2f} s")
    return delays, rate, skipped


def trips(kind: str, folder: str) -> list[float]:
    """Return the times of message round trips in microseconds."""
    troupe = Troupe(kind, "ipc", folder)
    try:
        troupe.hear(troupe.start("worker"))
        times: list[float] = troupe.hear(troupe.start("asker"))
        return times
    finally:
        troupe.end()


def idle(folder: str) -> None:
    """Print what a daemon with ten clients uses while nothing happens."""
    troupe = Troupe("ours", "ipc", folder)
    try:
        for child in [troupe.start("reader") for _ in range(READERS)]:
            troupe.hear(child)
        before = troupe.cpu_seconds()
        time.sleep(5)
        share = (troupe.cpu_seconds() - before) / 5
        print(f"idle server with {READERS} clients: {share:.2%} of a core, {troupe.memory_mb():.0f} MB")
    finally:
        troupe.end()


def main(rounds: int = 2) -> None:
    """Measure in so many rounds."""
    print(f"load of the machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    with tempfile.TemporaryDirectory() as folder:
        for transport in ("ipc", "tcp"):
            pairs = []
            for _ in range(rounds):
                pair = [updates(rival, transport, folder, READERS, "paced")[0] for rival in ("ours", "bare")]
                pairs.append([(percentile(d, 0.5), percentile(d, 0.99)) for d in pair])
            for ours, bare in pairs:
                print(
                    f"{transport} {READERS} readers {RATE} Hz: p50 {ours[0]:.0f}, p99 {ours[1]:.0f} us; bare "
                    f"p50 {bare[0]:.0f} us, p99 {bare[1]:.0f} us"
                )
            ratio = statistics.median(ours[0] / bare[0] for ours, bare in pairs)
            print(f"{transport} ratio of the p50: {ratio:.2f} (limit 2)")
        for _ in range(rounds):
            (_, ours_rate, skipped), (_, bare_rate, _) = (
                updates(kind, "ipc", folder, 1, "burst") for kind in ("ours", "bare")
            )
            print(f"ipc updates a second: {ours_rate:.0f} ({skipped} conflated); bare {bare_rate:.0f}")
        for _ in range(rounds):
            ours_trips, bare_trips = trips("ours", folder), trips("bare", folder)
            print(
                f"ipc message and answer: p50 {percentile(ours_trips, 0.5):.0f} us, p99 "
                f"{percentile(ours_trips, 0.99):.0f} us; bare p50 {percentile(bare_trips, 0.5):.0f} us"
            )
        idle(folder)


if __name__ == "__main__":
    if len(sys.argv) > 2:  # a part in a round: its name and what it needs
        globals()[sys.argv[1]](*sys.argv[2:4])
    else:
        main(*map(int, sys.argv[1:]))
