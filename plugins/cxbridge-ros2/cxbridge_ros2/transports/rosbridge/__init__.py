"""ROS 2 over rosbridge: a websocket to a server of rosbridge_suite, for robots with any RMW.

Messages are JSON. Byte arrays are texts in Base64; NaN and infinities become ``null``, which is read as NaN.
The server has operations for whole actions, and does not report the acceptance of a goal, so that each goal
counts as accepted when it is sent.
"""

from cxbridge_ros2.transports.rosbridge.node import RosbridgeNode

__all__ = ["RosbridgeNode"]
