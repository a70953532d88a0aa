"""Load between us and a node of rclpy: what is lost, what comes twice, and what fifty robots cost a loop.

``ROS2_SETUP`` names the folder with the setup.bash of a ROS 2, ``ROS2_PYTHON`` its Python. Without them
nothing is measured.

    python -m benchmarks ros2_load
"""

from __future__ import annotations

import os
import random
import statistics
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import Any

from benchmarks.harness import report

MESSAGES, RATE_HZ = 10_000, 1000
CALLS, GOALS, AT_ONCE = 1000, 500, 6
BIG_BYTES, BIG_HZ, BIG_S = 1 << 20, 50, 10
LOOP_HZ, LOOP_S = 30, 10
DEEP = 20_000
ABORTED = 13
IMPORT_S = 0.3
LOOP_SHARE = 0.1


def until(node: Any, done: Callable[[], object], limit_s: float = 30.0) -> bool:
    """Poll until something is true; return whether it became so."""
    end = time.monotonic() + limit_s
    while not done() and time.monotonic() < end:
        node.poll(0.02)
    return bool(done())


def paced(node: Any, count: int, rate_hz: float, send: Callable[[int], None]) -> None:
    """Send at a rate, and take what comes meanwhile."""
    begun = time.monotonic()
    for number in range(count):
        send(number)
        while (rest := begun + (number + 1) / rate_hz - time.monotonic()) > 0:
            node.poll(rest)
        node.poll()


def tell(what: str, sent: int, came: Counter[Any]) -> None:
    """Print what was lost, and what came more than once."""
    lost, twice = sent - len(came), sum(count - 1 for count in came.values())
    print(f"  {what}: {sent} sent, {lost} lost, {twice} twice")


def small(node: Any) -> None:
    """Send messages at 1 kHz to a node that echoes them."""
    from cxbridge_ros2.qos import QosProfile

    deep = QosProfile(depth=DEEP)
    came: Counter[str] = Counter()
    end = node.subscribe("/load_out", "std_msgs/msg/String", lambda each: came.update([each["data"]]), deep)
    there = node.publisher("/load_in", "std_msgs/msg/String", deep)
    until(node, lambda: there.subscriptions)
    while not came:
        there.publish({"data": "first"})
        node.poll(0.2)
    came.clear()
    paced(node, MESSAGES, RATE_HZ, lambda number: there.publish({"data": str(number)}))
    until(node, lambda: len(came) >= MESSAGES, 10)
    del came["first"]
    tell(f"messages at {RATE_HZ} Hz, there and back", MESSAGES, came)
    end()


def big(node: Any) -> None:
    """Send messages of 1 MB to a node that echoes them."""
    from cxbridge_ros2.qos import QosProfile

    deep, count = QosProfile(depth=100), BIG_HZ * BIG_S
    came: Counter[int] = Counter()

    def take(message: Any) -> None:
        came.update([int.from_bytes(bytes(message["data"][:4]), "little")])

    end = node.subscribe("/big_out", "std_msgs/msg/UInt8MultiArray", take, deep)
    there = node.publisher("/big_in", "std_msgs/msg/UInt8MultiArray", deep)
    until(node, lambda: there.subscriptions)
    node.poll(0.5)
    rest = bytes(BIG_BYTES - 4)
    started = time.process_time()
    begun = time.monotonic()
    paced(
        node,
        count,
        BIG_HZ,
        lambda number: there.publish({"layout": {}, "data": number.to_bytes(4, "little") + rest}),
    )
    seconds = time.monotonic() - begun
    until(node, lambda: len(came) >= count, 5)
    share = (time.process_time() - started) / (time.monotonic() - begun)
    tell(f"messages of 1 MB at {count / seconds:.0f} Hz ({BIG_HZ} wanted), there and back", count, came)
    print(f"    {share:.0%} of a core here")
    end()


def calls(node: Any) -> None:
    """Call a service."""
    add = node.client("/add", "example_interfaces/srv/AddTwoInts")
    until(node, lambda: add.is_served)
    came: Counter[int] = Counter()
    for number in range(CALLS):
        add.call({"a": number, "b": 0}, lambda each: came.update([each["sum"]]))
        until(node, partial(_are_few, came, number + 1))
    until(node, lambda: len(came) >= CALLS, 10)
    tell("calls of a service", CALLS, came)


def _are_few(came: Counter[int], sent: int) -> bool:
    return sent - came.total() <= AT_ONCE


def goals(node: Any) -> None:
    """Send goals that succeed, and others that are rejected, aborted or cancelled."""
    from cxbridge_ros2.actions import ActionClient, GoalStatus

    draw = random.Random(1)
    wanted = {"succeed": 3, "reject": -1, "abort": ABORTED, "cancel": 1000}
    ended = {
        "succeed": GoalStatus.SUCCEEDED,
        "abort": GoalStatus.ABORTED,
        "cancel": GoalStatus.CANCELED,
    }
    with ActionClient(node, "/fibonacci", "example_interfaces/action/Fibonacci") as client:
        until(node, lambda: client.is_served)
        node.poll(1.0)
        open_goals: list[tuple[str, Any]] = []
        cancelled: list[Any] = []
        right: Counter[str] = Counter()
        sent: Counter[str] = Counter()

        def look() -> bool:
            for kind, goal in list(open_goals):
                if kind == "cancel" and goal.feedback and goal not in cancelled:
                    cancelled.append(goal)
                    goal.cancel()
                if goal.is_over:
                    open_goals.remove((kind, goal))
                    right[kind] += (
                        goal.is_accepted is False if kind == "reject" else goal.status is ended[kind]
                    )
            return len(open_goals) < AT_ONCE

        for _ in range(GOALS):
            kind = draw.choice(list(wanted))
            sent[kind] += 1
            open_goals.append((kind, client.send({"order": wanted[kind]})))
            until(node, look)
        until(node, lambda: look() and not open_goals)
    words = ", ".join(f"{kind} {right[kind]} of {sent[kind]}" for kind in wanted)
    print(f"  goals of an action that ended as they should: {words}")


def robots(node: Any) -> None:
    """Listen to fifty robots in a loop of 30 Hz."""
    came: Counter[int] = Counter()
    for number in range(50):
        node.subscribe(
            f"/robot{number}/odom",
            "nav_msgs/msg/Odometry",
            lambda _each, number=number: came.update([number]),
        )
    drive = node.publisher("/drive", "std_msgs/msg/Bool")
    until(node, lambda: drive.subscriptions)
    drive.publish({"data": True})
    until(node, lambda: len(came) == 50)
    came.clear()
    busy, begun = 0.0, time.monotonic()
    for number in range(LOOP_HZ * LOOP_S):
        started = time.process_time()
        node.poll()
        busy += time.process_time() - started
        time.sleep(max(0.0, begun + (number + 1) / LOOP_HZ - time.monotonic()))
    drive.publish({"data": False})
    rate = sum(came.values()) / (time.monotonic() - begun)
    print(f"  odometry of 50 robots: {rate:.0f} messages a second")
    report("share of a loop of 30 Hz", busy / (time.monotonic() - begun), LOOP_SHARE)


def imports() -> None:
    """Measure what the extra costs to import."""

    def once(text: str) -> float:
        started = time.perf_counter()
        subprocess.run([sys.executable, "-c", text], check=True)
        return time.perf_counter() - started

    pairs = [(once("import cxbridge_ros2.transports.dds"), once("import cxbridge.clock")) for _ in range(9)]
    report("seconds to import the extra", statistics.median(ours - bare for ours, bare in pairs), IMPORT_S)


def main() -> None:
    """Measure all, where there is a ROS."""
    imports()
    if not os.environ.get("ROS2_SETUP"):
        print("  ROS2_SETUP names no ROS 2: no load is measured")
        return
    os.environ.setdefault("ROS_DOMAIN_ID", "77")
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    from cxbridge_ros2.definitions import Definitions
    from cxbridge_ros2.transports.dds import DdsNode
    from ros2_tests.conftest import start, stop
    from ros2_tests.peer import PACKAGES

    peer = start("rclpy", "load.py")
    try:
        with DdsNode("bench", Definitions([PACKAGES], environment={})) as node:
            for measure in (small, calls, goals, big, robots):
                measure(node)
    finally:
        stop(peer)


if __name__ == "__main__":
    main()
