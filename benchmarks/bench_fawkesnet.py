"""The cost of the Fawkes port, against bare sockets of the same topology, and against Fawkes.

    python benchmarks/bench_fawkesnet.py [--seconds N] [--json]

Three processes communicate over the loopback, as in the measurements of Fawkes: a writing client, the server,
a reading client. *c2c* is the time from the writer's write() to the reader's listener, for TestInterface (a
block of 64 bytes); *open* is the time of an opening for reading and a closing, *list* that of a listing. The
bare sockets send as many bytes for *c2c*: one frame to the server, and the two frames of a changed write from
the server to writer and reader. For *open* and *list*, they send the bytes of an opening, which the server
echoes. The figures of Fawkes are those of Fawkes 649cec084, as shipped (two writes per frame, with Nagle's
algorithm) and with TCP_NODELAY.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing as mp
import selectors
import socket
import statistics
import struct
import sys
import threading
import time
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from typing import Any

from cxbridge.blackboard import Listener, LocalBlackBoard
from cxbridge.clock import RealClock
from cxbridge.interfaces import default_registry
from cxbridge_fawkes.network.client import FawkesBlackBoard
from cxbridge_fawkes.network.server import FawkesServer

BLOCK_BYTES = 64  # a block of TestInterface
HEAD_BYTES = 28  # a data message before its block
OPEN_BYTES = 136  # a message that opens an interface: frame header 8, type 48, id 64, hash 16
SPACINGS_S = (0.1, 0.001)
FAST_WRITES = 20_000  # writes without a pause
FAWKES = {  # as shipped, with TCP_NODELAY: p50 in microseconds, and updates per second
    "c2c, 100 ms apart": (42_700, 631),
    "c2c, 1 ms apart": (354, 334),
    "open": (88_000, 582),
    "list": (44_000, 195),
    "updates/s": (4_619, 4_581),
}
Report = dict[str, float]
"""Figures by name: times in microseconds, rates per second, shares."""


def percentiles(seconds: list[float]) -> tuple[float, float]:
    """Return p50 and p99 in microseconds."""
    ordered = sorted(seconds)
    return statistics.median(ordered) * 1e6, ordered[int(len(ordered) * 0.99)] * 1e6


# -- through cxbridge


def serve(pipe: Connection) -> None:
    """Serve until the pipe receives an object."""
    clock = RealClock()
    with FawkesServer(LocalBlackBoard(default_registry(), clock), port=0) as server:
        pipe.send(server.port)
        pipe.recv()


class ReadRecorder(Listener):
    """Records the time of each event, and the time of the first event at which each number was read."""

    def __init__(self) -> None:
        self.read_times: dict[int, float] = {}
        self.event_times: list[float] = []

    def data_refreshed(self, interface: Any) -> None:
        now = time.perf_counter()
        self.event_times.append(now)
        interface.read()
        self.read_times.setdefault(interface.test_int, now)


def connect(port: int) -> FawkesBlackBoard:
    """Connect to a local port."""
    url = f"fawkes://127.0.0.1:{port}"
    return FawkesBlackBoard(url, default_registry(), RealClock(), timeout=60)  # a Fawkes takes long to sync


def write(port: int, pipe: Connection) -> None:
    """Do the jobs of the pipe until None: write as many numbers as a job says, with its spacing in seconds.

    After each job, the pipe gets the pairs of number and time of the write.
    """
    with connect(port) as board:
        writer: Any = board.open_for_writing("TestInterface", "bench")
        number = 0
        pipe.send(None)
        while (job := pipe.recv()) is not None:
            count, spacing = job
            times = []
            for _ in range(count):
                number += 1
                writer.test_int = number
                times.append((number, time.perf_counter()))
                writer.write()
                if spacing:
                    time.sleep(spacing)
            board.flush()
            pipe.send(times)


def measure_cxbridge(seconds: float) -> Report:
    """Return the figures of cxbridge's clients and server."""
    pipe, child_end = mp.Pipe()
    server = mp.Process(target=serve, args=(child_end,), daemon=True)
    server.start()
    result = measure_clients(pipe.recv(), seconds)
    pipe.send(None)
    server.join()
    return result


def measure_clients(port: int, seconds: float) -> Report:
    """Return the figures of cxbridge's clients with the server at a local port."""
    result: Report = {}
    jobs, work = mp.Pipe()
    with connect(port) as board:
        reader: Any = board.open_for_reading("TestInterface", "bench")
        recorder = ReadRecorder()
        board.register_listener(recorder, reader)
        writer = mp.Process(target=write, args=(port, work), daemon=True)
        writer.start()
        jobs.recv()  # the writer is ready
        for spacing in SPACINGS_S:
            sent = ask(jobs, (int(min(seconds, 2000 * spacing) / spacing), spacing))
            board.flush()
            # a late call of a listener reads the data of a later write: some numbers are not read
            latencies = [
                recorder.read_times[number] - when for number, when in sent if number in recorder.read_times
            ]
            set_percentiles(result, f"c2c, {spacing * 1000:g} ms apart", latencies)
        recorder.event_times.clear()
        sent = ask(jobs, (FAST_WRITES, 0))
        board.flush()
        result["updates/s"] = len(recorder.event_times) / (recorder.event_times[-1] - sent[0][1])
        result["events"] = len(recorder.event_times) / FAST_WRITES
        result["values seen"] = sum(number in recorder.read_times for number, _ in sent) / FAST_WRITES
        jobs.send(None)
        writer.join()
        openings = timed(lambda: board.open_for_reading("TestInterface", "bench").close(), seconds)
        set_percentiles(result, "open", openings)
        set_percentiles(result, "list", timed(board.list_all, seconds))
    return result


def ask(pipe: Connection, job: object) -> Any:
    """Send a job, and return its result."""
    pipe.send(job)
    return pipe.recv()


def timed(work: Callable[[], object], seconds: float) -> list[float]:
    """Repeat the work for the seconds, but at most for two; return the seconds of each repetition."""
    times = []
    end = time.perf_counter() + min(seconds, 2)
    while (started := time.perf_counter()) < end:
        work()
        times.append(time.perf_counter() - started)
    return times


def set_percentiles(result: Report, figure: str, seconds: list[float]) -> None:
    """Set p50 and p99 of a figure."""
    result[figure], result[f"{figure} p99"] = percentiles(seconds)


# -- bare sockets


def relay(pipe: Connection) -> None:
    """Accept two connections: send each frame of the first connection twice to both, and echo the second."""
    listener = socket.create_server(("127.0.0.1", 0))
    pipe.send(listener.getsockname()[1])
    connections = [listener.accept()[0] for _ in range(2)]
    selector = selectors.DefaultSelector()
    size = HEAD_BYTES + BLOCK_BYTES
    for sock in connections:
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        selector.register(sock, selectors.EVENT_READ)
    pending = b""
    while True:
        for key, _ in selector.select():
            ready: Any = key.fileobj
            data = ready.recv(65536)
            if not data:
                return
            if ready is not connections[0]:
                ready.sendall(data)
                continue
            pending += data
            whole = len(pending) // size * size
            for start in range(0, whole, size):
                frame = pending[start : start + size]
                for other in connections:
                    other.sendall(frame + frame)
            pending = pending[whole:]


def send_bare(port: int, pipe: Connection) -> None:
    """Do the work of :func:`write` with a bare socket."""
    sock = socket.create_connection(("127.0.0.1", port))
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    number = 0
    pipe.send(None)
    while (job := pipe.recv()) is not None:
        count, spacing = job
        times = []
        echo = threading.Thread(target=drain, args=(sock, 2 * count * (HEAD_BYTES + BLOCK_BYTES)))
        echo.start()
        for _ in range(count):
            number += 1
            times.append((number, time.perf_counter()))
            sock.sendall(struct.pack("=I", number) + bytes(HEAD_BYTES + BLOCK_BYTES - 4))
            if spacing:
                time.sleep(spacing)
        echo.join()
        pipe.send(times)


def drain(sock: socket.socket, size: int) -> None:
    """Receive a number of bytes, and drop them."""
    while size:
        size -= len(sock.recv(min(size, 65536)))


def receive_bare(sock: socket.socket, count: int, read_times: dict[int, float]) -> None:
    """Receive two frames of each write; set the time of the first of them by the number of the write."""
    size = HEAD_BYTES + BLOCK_BYTES
    pending, remaining = b"", 2 * count
    while remaining:
        pending += sock.recv(65536)
        now = time.perf_counter()
        whole = len(pending) // size * size
        for start in range(0, whole, size):
            read_times.setdefault(struct.unpack_from("=I", pending, start)[0], now)
        remaining -= whole // size
        pending = pending[whole:]


def measure_bare(seconds: float) -> Report:
    """Return the figures of bare sockets of the same topology."""
    result: Report = {}
    (pipe, child_end), (jobs, work) = mp.Pipe(), mp.Pipe()
    server = mp.Process(target=relay, args=(child_end,), daemon=True)
    server.start()
    port = pipe.recv()
    writer = mp.Process(target=send_bare, args=(port, work), daemon=True)
    writer.start()
    jobs.recv()  # the writer is ready
    with socket.create_connection(("127.0.0.1", port)) as sock:
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for spacing in (*SPACINGS_S, 0):
            count = int(min(seconds, 2000 * spacing) / spacing) if spacing else FAST_WRITES
            read_times: dict[int, float] = {}
            jobs.send((count, spacing))
            receive_bare(sock, count, read_times)
            sent = jobs.recv()
            latencies = [read_times[number] - when for number, when in sent]
            if spacing:
                set_percentiles(result, f"c2c, {spacing * 1000:g} ms apart", latencies)
            else:
                result["updates/s"] = count / (max(read_times.values()) - sent[0][1])

        def round_trip() -> None:
            sock.sendall(bytes(OPEN_BYTES))
            remaining = OPEN_BYTES
            while remaining:
                remaining -= len(sock.recv(remaining))

        # the bare sockets send the same bytes for both
        set_percentiles(result, "open", timed(round_trip, seconds))
        set_percentiles(result, "list", timed(round_trip, seconds))
    jobs.send(None)
    writer.join(5)
    server.terminate()
    server.join()
    return result


# -- the report


def print_against_fawkes(ours: Report, real: Report) -> None:
    """Print the figures of the same clients with a real Fawkes as their server."""
    print("the same clients with the Fawkes that runs here:")
    for figure in FAWKES:
        factor = ours[figure] / real[figure] if figure == "updates/s" else real[figure] / ours[figure]
        print(f"  {figure:20} {real[figure]:9.0f}, ours {ours[figure]:9.0f}: {factor:.1f} times")


def main(arguments: Sequence[str] = ()) -> int:
    """Measure and print.

    :param arguments: the arguments of the command line.
    :returns: 1 if a figure misses its limit, otherwise 0.
    """
    parser = argparse.ArgumentParser(description="the Fawkes port, against bare sockets and Fawkes")
    parser.add_argument("--seconds", type=float, default=5.0, help="for each measurement, at most")
    parser.add_argument("--fawkes", type=int, metavar="PORT", help="a real Fawkes here, measured as well")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(arguments)
    ours, bare = measure_cxbridge(options.seconds), measure_bare(options.seconds)
    if options.fawkes:
        print_against_fawkes(ours, measure_clients(options.fawkes, options.seconds))
    if options.json:
        print(json.dumps({"cxbridge": ours, "bare sockets": bare, "fawkes": FAWKES}, indent=1))
    else:
        print(f"{'':20} {'cxbridge':>18} {'bare sockets':>18} {'Fawkes':>9} {'..nodelay':>9}  to shipped")
        for figure, (shipped, nodelay) in FAWKES.items():
            factor = ours[figure] / shipped if figure == "updates/s" else shipped / ours[figure]
            ours_text, bare_text = (
                f"{times[figure]:9.0f} {times.get(f'{figure} p99', 0) or '':>8.5}" for times in (ours, bare)
            )
            print(f"{figure:20} {ours_text:>18} {bare_text:>18} {shipped:9} {nodelay:9}  {factor:.1f} times")
        print(
            f"p50 and p99 in us; of {FAST_WRITES} updates without a pause {ours['events']:.0%} were told, "
            f"{ours['values seen']:.0%} of the values were read by the listener: it reads the newest"
        )
    # the limits of docs/evidence/performance.md: factors to the Fawkes as shipped
    slow = [figure for figure in ("c2c, 100 ms apart", "open") if FAWKES[figure][0] / ours[figure] < 50]
    slow += ["updates/s"] if ours["updates/s"] < 2 * FAWKES["updates/s"][0] else []
    print(
        "TOO SLOW: " + ", ".join(slow) if slow else "within the limits: 50 times faster, twice the throughput"
    )
    return 1 if slow else 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
