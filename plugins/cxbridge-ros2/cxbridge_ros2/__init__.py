"""ROS 2 without a ROS installation: nodes, messages, skills, and recordings; see docs/ros2.md."""
