"""Publish a static transform and moving transforms with rclpy."""

import rclpy
from geometry_msgs.msg import TransformStamped
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage

rclpy.init()
node = rclpy.create_node("sends_transforms")
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
static = node.create_publisher(TFMessage, "/tf_static", latched)
moving = node.create_publisher(TFMessage, "/tf", 100)


def transform(frame, child, x):
    each = TransformStamped()
    each.header.stamp = node.get_clock().now().to_msg()
    each.header.frame_id, each.child_frame_id = frame, child
    each.transform.translation.x = x
    each.transform.rotation.w = 1.0
    return each


static.publish(TFMessage(transforms=[transform("base_link", "gripper", 0.5)]))
node.create_timer(
    0.05,
    lambda: moving.publish(
        TFMessage(transforms=[transform("map", "base_link", 2.0), transform("map", "other", 1.0)])
    ),
)
print("ready", flush=True)  # noqa: T201
rclpy.spin(node)
