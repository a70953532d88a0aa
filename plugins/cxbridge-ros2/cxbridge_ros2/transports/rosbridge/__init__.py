"""ROS 2 over rosbridge: a websocket to a server of rosbridge_suite, for robots with any RMW.

Messages are JSON. Bytes are Base64; NaN and infinities become ``null``, which is read as NaN. Actions are
calls of the server: it does not report acceptance, so each goal counts as accepted at once.
"""

from cxbridge_ros2.transports.rosbridge.node import RosbridgeNode, join

__all__ = ["RosbridgeNode", "join"]
