"""A node of the real rclpy with an echo, a service and an action, for the Python of a ROS installation."""

import time

import rclpy
from example_interfaces.action import Fibonacci
from example_interfaces.srv import AddTwoInts
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String

ABORTED = 13


class Peer(Node):
    def __init__(self):
        super().__init__("peer")
        group = ReentrantCallbackGroup()
        self.back = self.create_publisher(String, "/back", 100)
        self.create_subscription(String, "/there", self.back.publish, 100)
        self.create_service(AddTwoInts, "/add", self.add)
        ActionServer(
            self,
            Fibonacci,
            "/fibonacci",
            self.count,
            callback_group=group,
            goal_callback=lambda goal: GoalResponse.REJECT if goal.order < 0 else GoalResponse.ACCEPT,
            cancel_callback=lambda _goal: CancelResponse.ACCEPT,
        )

    def add(self, request, response):
        response.sum = request.a + request.b
        return response

    def count(self, goal):
        feedback, result = Fibonacci.Feedback(), Fibonacci.Result()
        numbers = [0, 1]
        while len(numbers) <= goal.request.order and not goal.is_cancel_requested:
            numbers.append((numbers[-1] + numbers[-2]) % 2**31)  # an int32
            feedback.sequence = numbers
            goal.publish_feedback(feedback)
            time.sleep(0.02)
        result.sequence = numbers
        if goal.is_cancel_requested:
            goal.canceled()
        elif goal.request.order == ABORTED:
            goal.abort()
        else:
            goal.succeed()
        return result


rclpy.init()
executor = MultiThreadedExecutor()
executor.add_node(Peer())
print("ready", flush=True)  # noqa: T201
executor.spin()
