"""The blackboard over ZeroMQ against bare pyzmq: the same processes and payload, in turns, in one run.

::

    python -m benchmarks.bench_zmq [ROUNDS]

Bare means the writer's DEALER, a daemon that passes the bytes from its ROUTER to its PUB, and the readers'
SUB. The blackboard does the work of its protocol in addition. Times are those of the machine's monotonic
clock, which processes share.
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
BLOCK_BYTES = 1216  # of SkillerInterface
READERS, RATE_HZ, SECONDS = 10, 1000, 3.0
BURST = 30_000  # writes without a pause
REPORTED_PAUSE_S = 0.05  # a pause of the machine that explains late updates
TRIPS = 1500  # messages with their replies


def percentile(values: list[float], share: float) -> float:
    """Return the value below which a share of the values lies."""
    return sorted(values)[min(len(values) - 1, int(len(values) * share))]


def send_result(result: Any) -> None:
    """Print a result for the parent as a line of JSON."""
    print(json.dumps(result), flush=True)


def pace(rate_hz: float, seconds: float, work: Callable[[], object]) -> None:
    """Call ``work`` at a rate for some seconds."""
    start = time.monotonic()
    for count in range(int(rate_hz * seconds)):
        wait_s = start + count / rate_hz - time.monotonic()
        if wait_s > 0:
            time.sleep(wait_s)
        work()


def wait_for_parent() -> None:
    """Wait for a line from the parent."""
    sys.stdin.readline()


# -- ours


def ours_daemon(url: str, _: str) -> None:
    """Serve the blackboard."""
    with ZmqBlackBoardServer(LocalBlackBoard(InterfaceRegistry(), RealClock()), [url]) as server:
        send_result(server.endpoints)
        wait_for_parent()


def connect(url: str) -> ZmqBlackBoard:
    """Connect to the blackboard."""
    return ZmqBlackBoard(url, InterfaceRegistry(), RealClock())


class _Arrivals(Listener):
    """The arrivals of updates, whose field ``error`` has the time of the write in nanoseconds."""

    def __init__(self) -> None:
        self.delays_us: list[float] = []
        self.last_s = 0.0

    def data_refreshed(self, interface: Any) -> None:
        interface.read()
        now = time.monotonic_ns()
        self.delays_us.append((now - int(interface.error)) / 1e3)
        self.last_s = now / 1e9


def ours_reader(url: str, _: str) -> None:
    """Receive updates until the parent sends a line.

    Sends the delays of all updates in microseconds, the time of the last update in seconds, and the number of
    skipped updates.
    """
    with connect(url) as board:
        arrivals = _Arrivals()
        reader = board.open_for_reading(TYPE, ID)
        board.register_listener(arrivals, reader, EventKind.DATA_REFRESHED)
        send_result("ready")
        wait_for_parent()
        board.flush()
        send_result({"delays": arrivals.delays_us, "last": arrivals.last_s, "skipped": board.skipped})
        wait_for_parent()


def ours_writer(url: str, mode: str) -> None:
    """Write the current time at RATE_HZ, in the mode ``burst`` without pauses.

    Sends the time in seconds at which the writes began.
    """
    with connect(url) as board:
        writer: Any = board.open_for_writing(TYPE, ID)

        def write() -> None:
            writer.error = str(time.monotonic_ns())
            writer.write()

        send_result("ready")
        wait_for_parent()
        first = time.monotonic()
        if mode == "burst":
            for _ in range(BURST):
                write()
        else:
            pace(RATE_HZ, SECONDS, write)
        board.flush()
        send_result({"first": first})
        wait_for_parent()


class _Replier(Listener):
    """Writes the text of each message into the interface."""

    def message_received(self, interface: Any, message: Any) -> bool:
        interface.error = message.skill_string
        interface.write()
        return False  # not queued, because nothing empties the bounded queue


def ours_worker(url: str, _: str) -> None:
    """Reply to each message with an update."""
    with connect(url) as board:
        board.register_listener(_Replier(), board.open_for_writing(TYPE, ID), EventKind.MESSAGE_RECEIVED)
        send_result("ready")
        wait_for_parent()


class _UpdateEvent(Listener):
    """An event that is set by each update."""

    def __init__(self) -> None:
        self.arrived = threading.Event()

    def data_refreshed(self, interface: Any) -> None:
        interface.read()
        self.arrived.set()


def ours_asker(url: str, _: str) -> None:
    """Send the microseconds from each message to the update that replies to it."""
    with connect(url) as board:
        reader: Any = board.open_for_reading(TYPE, ID)
        update = _UpdateEvent()
        board.register_listener(update, reader, EventKind.DATA_REFRESHED)
        trips_us = []
        for count in range(TRIPS):
            update.arrived.clear()
            message = reader.create_message("ExecSkillMessage")
            message.skill_string = str(count)
            start = time.monotonic_ns()
            reader.msgq_enqueue(message)
            assert update.arrived.wait(5)
            trips_us.append((time.monotonic_ns() - start) / 1e3)
        send_result(trips_us)
        wait_for_parent()


# -- bare


def _socket(kind: int, url: str, *, bind: bool = False) -> Any:
    socket: Any = zmq.Context.instance().socket(kind)
    socket.linger = 0  # a process ends without waiting for unsent frames
    socket.sndhwm = socket.rcvhwm = 100_000  # more than BURST: no frame is dropped
    if kind == zmq.SUB:
        socket.subscribe = b""
    if bind:
        socket.bind(url)
    else:
        socket.connect(url)
    return socket


def _pub_of(url: str) -> str:
    """Return the URL of the PUB of a daemon with a ROUTER at ``url``; ``*`` stands for any port."""
    return url if url.endswith("*") else f"{url}.pub"


def bare_daemon(url: str, _: str) -> None:
    """Pass writes to the PUB, and messages of the asker to the worker.

    Sends the URLs of ROUTER and PUB, with a space in between, as the only item of a list.
    """
    router, pub = _socket(zmq.ROUTER, url, bind=True), _socket(zmq.PUB, _pub_of(url), bind=True)
    bound = [socket.last_endpoint.decode() for socket in (router, pub)]
    send_result([" ".join(bound)])
    worker = b""
    poller: Any = zmq.Poller()
    poller.register(router, zmq.POLLIN)
    poller.register(sys.stdin, zmq.POLLIN)
    while sys.stdin.fileno() not in dict(poller.poll()):
        for _turn in range(64):  # as many frames as the daemon of cxbridge receives at once
            try:
                peer, kind, block = router.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                break
            if kind == b"worker":
                worker = peer
            elif kind == b"ask":
                router.send_multipart([worker, kind, block])
            else:
                pub.send(block)


def bare_reader(url: str, _: str) -> None:
    """Do the work of :func:`ours_reader`."""
    sub = _socket(zmq.SUB, url.rpartition(" ")[2])
    delays_us, last_s = [], 0.0
    send_result("ready")
    poller = zmq.Poller()
    poller.register(sub, zmq.POLLIN)
    poller.register(sys.stdin, zmq.POLLIN)
    while True:
        ready = dict(poller.poll())
        if sub in ready:
            block = sub.recv()
            now = time.monotonic_ns()
            delays_us.append((now - int(block[:20])) / 1e3)  # the block begins with the time, then has spaces
            last_s = now / 1e9
        elif ready:
            break
    wait_for_parent()
    send_result({"delays": delays_us, "last": last_s, "skipped": 0})
    wait_for_parent()


def bare_writer(url: str, mode: str) -> None:
    """Do the work of :func:`ours_writer`."""
    dealer = _socket(zmq.DEALER, url.partition(" ")[0])

    def write() -> None:
        dealer.send_multipart([b"write", str(time.monotonic_ns()).encode().ljust(BLOCK_BYTES)])

    send_result("ready")
    wait_for_parent()
    first = time.monotonic()
    if mode == "burst":
        for _ in range(BURST):
            write()
    else:
        pace(RATE_HZ, SECONDS, write)
    time.sleep(0.5)  # until the last write is sent
    send_result({"first": first})
    wait_for_parent()


def bare_worker(url: str, _: str) -> None:
    """Do the work of :func:`ours_worker`."""
    dealer = _socket(zmq.DEALER, url.partition(" ")[0])
    dealer.send_multipart([b"worker", b""])
    send_result("ready")
    poller = zmq.Poller()
    poller.register(dealer, zmq.POLLIN)
    poller.register(sys.stdin, zmq.POLLIN)
    while sys.stdin.fileno() not in dict(poller.poll()):
        dealer.send_multipart([b"write", dealer.recv_multipart()[1]])


def bare_asker(url: str, _: str) -> None:
    """Do the work of :func:`ours_asker`."""
    dealer, sub = _socket(zmq.DEALER, url.partition(" ")[0]), _socket(zmq.SUB, url.rpartition(" ")[2])
    time.sleep(0.5)  # until the daemon knows the subscription
    trips_us = []
    for count in range(TRIPS):
        start = time.monotonic_ns()
        dealer.send_multipart([b"ask", str(count).encode().ljust(BLOCK_BYTES)])
        assert sub.poll(5000)
        sub.recv()
        trips_us.append((time.monotonic_ns() - start) / 1e3)
    send_result(trips_us)
    wait_for_parent()


# -- the parent


class PauseWatch:
    """Measures the longest delay of a thread that runs every 2 ms: the delay that the machine adds."""

    def __enter__(self) -> Self:
        self.longest_s = 0.0
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._measure)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()

    def _measure(self) -> None:
        before = time.monotonic()
        while not self._end.wait(0.002):
            now = time.monotonic()
            self.longest_s = max(self.longest_s, now - before - 0.002)
            before = now


class Processes:
    """Child processes with roles, of one rival (``ours`` or ``bare``); the daemon is the first."""

    def __init__(self, rival: str, transport: str, folder: str) -> None:
        self._rival = rival
        self._children: list[subprocess.Popen[str]] = []
        # a new socket for each daemon: the folder has a file for each daemon before
        number = len(list(Path(folder).iterdir()))
        Path(folder, str(number)).touch()
        url = "tcp://127.0.0.1:*" if transport == "tcp" else f"ipc://{folder}/s{number}"
        self.url = url
        daemon = self.start("daemon")
        self.url = self.receive(daemon)[0]

    def start(self, role: str, mode: str = "") -> subprocess.Popen[str]:
        """Start a child with a role."""
        command = [sys.executable, "-m", "benchmarks.bench_zmq", f"{self._rival}_{role}", self.url, mode]
        child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self._children.append(child)
        return child

    def receive(self, child: subprocess.Popen[str]) -> Any:
        """Return the next result of a child."""
        assert child.stdout is not None
        return json.loads(child.stdout.readline())

    def resume(self, child: subprocess.Popen[str]) -> None:
        """Send the line for which a child waits."""
        assert child.stdin is not None
        child.stdin.write("\n")
        child.stdin.flush()

    def cpu_seconds(self) -> float:
        """Return the processor time of the daemon, in seconds."""
        with Path(f"/proc/{self._children[0].pid}/stat").open() as stat:
            fields = stat.read().rpartition(")")[2].split()
        # utime and stime
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def memory_mb(self) -> float:
        """Return the resident memory of the daemon, in MB."""
        with Path(f"/proc/{self._children[0].pid}/statm").open() as statm:
            return int(statm.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6

    def end(self) -> None:
        """End all children."""
        for child in reversed(self._children):
            child.communicate("\n\n\n")  # at least as many lines as a child may still wait for


def measure_updates(
    rival: str, transport: str, folder: str, readers: int, mode: str
) -> tuple[list[float], float, int]:
    """Return the delays at all readers in us, the updates per second, and the number of skipped updates.

    In the mode ``paced``, skipped updates and a long pause of the machine are printed.

    :param mode: ``paced`` or ``burst``.
    """
    processes = Processes(rival, transport, folder)
    try:
        children = [processes.start("reader") for _ in range(readers)]
        writer = processes.start("writer", mode)
        for child in (*children, writer):
            processes.receive(child)
        time.sleep(0.3)  # until the daemon knows the subscriptions
        with PauseWatch() as pauses:
            processes.resume(writer)
            begin_s = processes.receive(writer)["first"]
        time.sleep(0.2)  # until the readers have the last update
        for child in children:
            processes.resume(child)
        results = [processes.receive(child) for child in children]
    finally:
        processes.end()
    delays_us = [delay for result in results for delay in result["delays"]]
    last_s = max(result["last"] for result in results)
    rate = len(results[0]["delays"]) / (last_s - begin_s)
    skipped = sum(result["skipped"] for result in results)
    if mode == "paced" and (skipped or pauses.longest_s > REPORTED_PAUSE_S):
        print(f"{rival}: {skipped} conflated, the machine paused for {pauses.longest_s:.2f} s")
    return delays_us, rate, skipped


def measure_trips(rival: str, folder: str) -> list[float]:
    """Return the times of message round trips in microseconds."""
    processes = Processes(rival, "ipc", folder)
    try:
        processes.receive(processes.start("worker"))
        times_us: list[float] = processes.receive(processes.start("asker"))
        return times_us
    finally:
        processes.end()


def measure_idle(folder: str) -> None:
    """Print the processor time and memory of an idle daemon with ten clients."""
    processes = Processes("ours", "ipc", folder)
    try:
        for child in [processes.start("reader") for _ in range(READERS)]:
            processes.receive(child)
        before = processes.cpu_seconds()
        time.sleep(5)
        share = (processes.cpu_seconds() - before) / 5
        print(f"idle server with {READERS} clients: {share:.2%} of a core, {processes.memory_mb():.0f} MB")
    finally:
        processes.end()


def main(rounds: int = 2) -> None:
    """Print the figures of each round."""
    print(f"load of the machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    with tempfile.TemporaryDirectory() as folder:
        for transport in ("ipc", "tcp"):
            pairs = []
            for _ in range(rounds):
                pair = [
                    measure_updates(rival, transport, folder, READERS, "paced")[0]
                    for rival in ("ours", "bare")
                ]
                pairs.append(
                    [(percentile(delays_us, 0.5), percentile(delays_us, 0.99)) for delays_us in pair]
                )
            for ours, bare in pairs:
                print(
                    f"{transport} {READERS} readers {RATE_HZ} Hz: p50 {ours[0]:.0f}, p99 {ours[1]:.0f} us; "
                    f"bare p50 {bare[0]:.0f} us, p99 {bare[1]:.0f} us"
                )
            ratio = statistics.median(ours[0] / bare[0] for ours, bare in pairs)
            print(f"{transport} ratio of the p50: {ratio:.2f} (limit 2)")
        for _ in range(rounds):
            (_, ours_rate, skipped), (_, bare_rate, _) = (
                measure_updates(rival, "ipc", folder, 1, "burst") for rival in ("ours", "bare")
            )
            print(f"ipc updates a second: {ours_rate:.0f} ({skipped} conflated); bare {bare_rate:.0f}")
        for _ in range(rounds):
            ours_trips, bare_trips = measure_trips("ours", folder), measure_trips("bare", folder)
            print(
                f"ipc message and answer: p50 {percentile(ours_trips, 0.5):.0f} us, p99 "
                f"{percentile(ours_trips, 0.99):.0f} us; bare p50 {percentile(bare_trips, 0.5):.0f} us"
            )
        measure_idle(folder)


if __name__ == "__main__":
    if len(sys.argv) > 2:  # a child process: its role and arguments
        globals()[sys.argv[1]](*sys.argv[2:4])
    else:
        main(*map(int, sys.argv[1:]))
