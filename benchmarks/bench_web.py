"""What browsers cost a daemon's loop: 50 that follow the events of each loop, one that does not read, and
questions to an agent with 10,000 facts and 1,000 goals.

In every loop an interface changes and a goal gets another mode. The clients are a process of their own. What
is measured is how long the work of a loop takes, from its begin to its end, with what it waits for the
server's thread; and how many loops there are. With and without clients, in turn.

Of a question it is measured how much of the loop's thread's time it takes in one loop at most, and in all.
"""

from __future__ import annotations

import contextlib
import json
import selectors
import socket
import statistics
import subprocess
import sys
import threading
import time
import urllib.request

from benchmarks.harness import report
from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.options import DaemonOptions
from cxbridge.events import GoalTransition
from cxbridge.mainloop import Hook
from cxbridge_web.queue import RequestQueue
from tests.support import ROOT

CLIENTS = 50
ROUNDS = 5
SETTLE_S = 1.5
MEASURE_S = 5.0
REQUEST = b"GET /api/cxbridge/events HTTP/1.1\r\nHost: localhost\r\n\r\n"


def follow(port: int, readers: int, sleepers: int) -> None:
    """Be the clients, until the process is ended."""
    waiting = [socket.create_connection(("127.0.0.1", port)) for _ in range(readers + sleepers)]
    with selectors.DefaultSelector() as selector:
        for number, client in enumerate(waiting):
            client.sendall(REQUEST)
            if number < readers:
                client.setblocking(False)
                selector.register(client, selectors.EVENT_READ)
        while True:
            for key, _ in selector.select():
                with contextlib.suppress(BlockingIOError):
                    key.fileobj.recv(1 << 20)  # type: ignore[union-attr]


class Measured:
    """A daemon whose loops are timed."""

    def __init__(self) -> None:
        settings: tuple[tuple[str, bool | int | list[str]], ...] = (
            ("fawkes/enable", False),
            ("zmq/endpoints", []),
            ("web/enable", True),
            ("web/port", 0),
        )
        self.daemon = Daemon(DaemonOptions(config=ROOT / "scenarios" / "test-scenario", settings=settings))
        self.times: list[float] = []
        self.pose = self.daemon.board.open_for_writing("Position3DInterface", "Pose", owner="bench")
        self.ready = threading.Event()
        loop = self.daemon.loop
        loop.add(Hook.POST_LOOP, self.tell)
        once = loop.run_once

        def timed() -> None:
            began = time.perf_counter()
            once()
            self.times.append(time.perf_counter() - began)

        loop.run_once = timed  # type: ignore[method-assign]
        self.thread = threading.Thread(target=self.daemon.run, kwargs={"on_ready": self.ready.set})

    def tell(self) -> None:
        number = self.daemon.loop.loops
        self.pose.set("translation", (number, 0.5, 1.0))
        self.pose.write()
        now = self.daemon.clock.now_us()
        mode = ("SELECTED", "EXPANDED")[number % 2]
        self.daemon.bus.emit(
            GoalTransition(now, "executive", "G", "C", "ACHIEVE", "nil", mode, "UNKNOWN", "")
        )

    @property
    def port(self) -> int:
        return int(self.daemon.endpoints[-1].rpartition(":")[2])

    def clients(self) -> int:
        with urllib.request.urlopen(f"{self.daemon.endpoints[-1]}/api/cxbridge/status") as reply:
            return int(json.load(reply)["web"]["clients"])

    def round(self, readers: int, sleepers: int) -> tuple[float, float]:
        """Return the median time of a loop's work in ms, and how many there are in a second."""
        program = [sys.executable, "-m", "benchmarks.bench_web", str(self.port), str(readers), str(sleepers)]
        with contextlib.ExitStack() as stack:
            if readers + sleepers:
                process = stack.enter_context(subprocess.Popen(program, cwd=ROOT))
                stack.callback(process.kill)
            while self.clients() != readers + sleepers:
                time.sleep(0.1)
            time.sleep(SETTLE_S)
            self.times.clear()
            began = time.perf_counter()
            time.sleep(MEASURE_S)
            times = self.times.copy()
            return 1000 * statistics.median(times), len(times) / (time.perf_counter() - began)


def compare(measured: Measured, what: str, readers: int, sleepers: int) -> None:
    """Measure with clients and without in turn, and print what they cost."""
    pairs = [(measured.round(readers, sleepers), measured.round(0, 0)) for _ in range(ROUNDS)]
    (work, rate), (bare, alone) = (
        (statistics.median(row[0] for row in rows), statistics.median(row[1] for row in rows))
        for rows in zip(*pairs, strict=True)
    )
    print(
        f"  a loop's work takes {work:.2f} ms against {bare:.2f} ms, {rate:.1f} loops/s against {alone:.1f}"
    )
    period_ms = measured.daemon.loop.period_us / 1000
    report(f"{what}: percent of a loop's time", 100 * (work - bare) / period_ms, limit=10)
    report(f"{what}: percent fewer loops", 100 * (1 - rate / alone), limit=10)


QUESTIONS = (
    "clips/executive/facts",
    "clips/executive/facts?limit=100",
    "clips-executive/goals",
    "clips-executive/plans",
    "clips-executive/domain-facts",
    "clips-executive/domain-facts?limit=100",
    "cxbridge/agenda",
    "cxbridge/rules",
    "cxbridge/status",
)
FACTS, GOALS, PLANS = 10_000, 1_000, 300
ASKED = 5
MOST_MS = 33


def fill(daemon: Daemon) -> None:
    """Give the executive its facts."""
    env = daemon.node.env  # type: ignore[union-attr]
    assert env is not None
    with env.lock:
        for number in range(GOALS):
            env.assert_string(f"(goal (id g{number}) (class C) (mode FORMULATED))")
        for number in range(PLANS):
            env.assert_string(f"(plan (id p{number}) (goal-id g{number}))")
            env.assert_string(f"(plan-action (id 1) (plan-id p{number}) (goal-id g{number}) (action-name a))")
        for number in range(FACTS - GOALS - 2 * PLANS):
            env.assert_string(f"(domain-fact (name at) (param-values r{number} p{number}))")


def ask(measured: Measured) -> None:
    """Ask an agent with many facts, and print what each question costs the loop."""
    daemon, turns = measured.daemon, list[float]()
    once = RequestQueue.poll

    def timed(queue: RequestQueue) -> None:
        began = time.thread_time()
        once(queue)
        turns.append(time.thread_time() - began)

    pause = urllib.request.Request(f"{daemon.endpoints[-1]}/api/cxbridge/pause", method="POST")
    urllib.request.urlopen(pause).close()  # or the rules would work on the goals
    fill(daemon)
    RequestQueue.poll = timed  # type: ignore[assignment, method-assign]
    try:
        for question in QUESTIONS:
            most, total, waited = [], [], []
            for _ in range(ASKED):
                turns.clear()
                began = time.perf_counter()
                with urllib.request.urlopen(f"{daemon.endpoints[-1]}/api/{question}") as reply:
                    reply.read()
                waited.append(1000 * (time.perf_counter() - began))
                most.append(1000 * max(turns))
                total.append(1000 * sum(turns))
            print(
                f"  {question}: {statistics.median(total):.1f} ms of the loop in all, "
                f"answered after {statistics.median(waited):.0f} ms"
            )
            report(f"{question}: ms of one loop", statistics.median(most), limit=MOST_MS)
    finally:
        RequestQueue.poll = once  # type: ignore[method-assign]


def main() -> None:
    """Measure and print."""
    measured = Measured()
    measured.thread.start()
    measured.ready.wait()
    try:
        compare(measured, f"{CLIENTS} that follow", CLIENTS, 0)
        compare(measured, "one that does not read", 0, 1)
        ask(measured)
    finally:
        measured.daemon.stop()
        measured.thread.join()


if __name__ == "__main__":
    if len(sys.argv) > 1:
        follow(*map(int, sys.argv[1:]))
    else:
        main()
