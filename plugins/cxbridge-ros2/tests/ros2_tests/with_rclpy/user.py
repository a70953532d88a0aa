"""Use the endpoints of the peer with the real rclpy, and print the results as JSON."""

import json
import sys
import time

import rclpy
from example_interfaces.action import Fibonacci
from example_interfaces.srv import AddTwoInts
from rclpy.action import ActionClient
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node("user")
got, feedback = [], []
publisher = node.create_publisher(String, "/there", 100)
node.create_subscription(String, "/back", lambda message: got.append(message.data), 100)
add = node.create_client(AddTwoInts, "/add")
count = ActionClient(node, Fibonacci, "/fibonacci")
assert add.wait_for_service(10)
assert count.wait_for_server(10)
limit = time.monotonic() + 10
while (
    not (publisher.get_subscription_count() and node.count_publishers("/back")) and time.monotonic() < limit
):
    rclpy.spin_once(node, timeout_sec=0.1)


def wait(future):
    rclpy.spin_until_future_complete(node, future, timeout_sec=10)
    return future.result()


trips = []
for number in range(int(sys.argv[1])):
    begin, before = time.perf_counter(), len(got)
    publisher.publish(String(data=f"message {number}"))
    while len(got) == before and time.perf_counter() - begin < 5:
        rclpy.spin_once(node, timeout_sec=0.5)
    trips.append(time.perf_counter() - begin)
calls, sums = [], []
for number in range(int(sys.argv[1])):
    begin = time.perf_counter()
    sums.append(wait(add.call_async(AddTwoInts.Request(a=number, b=1))).sum)
    calls.append(time.perf_counter() - begin)


def send(order, cancel=False):
    progress = []
    goal = wait(count.send_goal_async(Fibonacci.Goal(order=order), lambda message: progress.append(1)))
    if not goal.accepted:
        return {"accepted": False}
    code = None
    if cancel:
        code = wait(goal.cancel_goal_async()).return_code
    result = wait(goal.get_result_async())
    return {
        "accepted": True,
        "status": result.status,
        "result": list(result.result.sequence),
        "feedback": len(progress),
        "cancel": code,
    }


rounds = []
for _ in range(int(sys.argv[1])):
    begin = time.perf_counter()
    send(1)
    rounds.append(time.perf_counter() - begin)

results = {
    "got": got,
    "sums": sums,
    "trip": sorted(trips)[len(trips) // 2],
    "call": sorted(calls)[len(calls) // 2],
    "goal": sorted(rounds)[len(rounds) // 2],
    "goals": {
        "done": send(5),
        "rejected": send(-1),
        "aborted": send(13),
        "cancelled": send(1000, cancel=True),
    },
    "types": dict(node.get_topic_names_and_types()),
    "nodes": node.get_node_names(),
    "of_peer": dict(node.get_publisher_names_and_types_by_node("peer", "/")),
    "services_of_peer": dict(node.get_service_names_and_types_by_node("peer", "/")),
}
print(json.dumps(results))  # noqa: T201
