"""A node of the real rclpy under load: echoes small and big messages, adds, counts, drives robots."""

import time

import rclpy
from example_interfaces.action import Fibonacci
from example_interfaces.srv import AddTwoInts
from nav_msgs.msg import Odometry
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Bool, String, UInt8MultiArray

ABORTED = 13
DEEP = 20000
ROBOTS = 50
RATE_HZ = 20


class Load(Node):
    def __init__(self):
        super().__init__("load")
        group = ReentrantCallbackGroup()
        self.small = self.create_publisher(String, "/load_out", DEEP)
        self.create_subscription(String, "/load_in", self.small.publish, DEEP)
        self.big = self.create_publisher(UInt8MultiArray, "/big_out", 100)
        self.create_subscription(UInt8MultiArray, "/big_in", self.big.publish, 100)
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
        self.robots = [self.create_publisher(Odometry, f"/robot{n}/odom", 10) for n in range(ROBOTS)]
        self.drives = False
        self.create_subscription(Bool, "/drive", self.drive, 10)
        self.create_timer(1 / RATE_HZ, self.move)

    def drive(self, message):
        self.drives = message.data

    def move(self):
        if self.drives:
            odometry = Odometry()
            odometry.header.stamp = self.get_clock().now().to_msg()
            for robot in self.robots:
                robot.publish(odometry)

    def add(self, request, response):
        response.sum = request.a + request.b
        return response

    def count(self, goal):
        result = Fibonacci.Result()
        numbers = [0, 1]
        while len(numbers) <= goal.request.order and not goal.is_cancel_requested:
            numbers.append((numbers[-1] + numbers[-2]) % 2**31)
            goal.publish_feedback(Fibonacci.Feedback(sequence=numbers))
            time.sleep(0.01)
        result.sequence = numbers
        if goal.is_cancel_requested:
            goal.canceled()
        elif goal.request.order == ABORTED:
            goal.abort()
        else:
            goal.succeed()
        return result


rclpy.init()
executor = MultiThreadedExecutor(num_threads=16)
executor.add_node(Load())
print("ready", flush=True)  # noqa: T201
executor.spin()
