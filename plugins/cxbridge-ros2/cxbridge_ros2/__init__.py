"""ROS 2 without a ROS installation: message definitions, CDR and type hashes; see docs/ros2.md."""
