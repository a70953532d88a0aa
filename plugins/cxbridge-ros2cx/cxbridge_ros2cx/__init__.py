"""The CLIPS Executive of the thesis, for ROS 2: its configuration, its features, its executors.

See docs/evidence/ros2cx.md.
"""
