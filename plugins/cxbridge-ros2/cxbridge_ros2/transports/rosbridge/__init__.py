"""ROS 2 over rosbridge: a websocket to a server of rosbridge_suite, for robots with any RMW.

Messages are JSON there. Bytes are Base64, and numbers that JSON lacks (NaN, infinities) are ``null``: both
come as NaN. Actions are calls of the server's own: an accepted goal is not reported before its feedback or
its result, so each is taken for accepted at once.
"""

from cxbridge_ros2.transports.rosbridge.node import RosbridgeNode, join

__all__ = ["RosbridgeNode", "join"]
