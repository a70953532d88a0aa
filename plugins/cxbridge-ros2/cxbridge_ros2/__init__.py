"""ROS 2 without a ROS installation: definitions of messages, their CDR and type hashes (docs/ros2.md)."""
