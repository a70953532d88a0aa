"""A managed node with parameters, by rclpy. The node logs `configured`, and the first activation fails."""

import rclpy
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn


class Managed(LifecycleNode):
    def __init__(self):
        super().__init__("managed")
        self.declare_parameter("speed", 1.5)
        self.declare_parameter("names", ["a", "b"])
        self.declare_parameter("limits.low", 3)
        self.declare_parameter("limits.deep.high", 7)
        self.declare_parameter("works", True)
        self.declare_parameter("fixed", "yes", ParameterDescriptor(read_only=True))
        self.attempts = 0

    def on_configure(self, state):
        self.get_logger().warn("configured")
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        self.attempts += 1
        if self.attempts == 1:
            return TransitionCallbackReturn.FAILURE
        return super().on_activate(state)

    def on_cleanup(self, state):
        raise RuntimeError("cannot clean up")

    def on_error(self, state):
        return TransitionCallbackReturn.FAILURE  # the default of rclcpp


rclpy.init()
node = Managed()
executor = SingleThreadedExecutor()
executor.add_node(node)
print("ready", flush=True)  # noqa: T201
executor.spin()
