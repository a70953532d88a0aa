"""The CLIPS Executive of the thesis for ROS 2: its configuration, features and executors.

See docs/evidence/ros2cx.md.
"""
