"""Agents of the two CLIPS Executives for ROS 2, without ROS.

The thesis' executive is fawkesrobotics/ros2-clips-executive (2021), the work of a bachelor's thesis. The
modules of this package run a checkout of that executive: its parameter files, features and executors
(docs/evidence/ros2cx.md). The ROS 2 CX is the successor, carologistics/clips_executive. The package ``cx``
runs the successor's node ``clips_manager``, and the package ``rl`` makes its learning agents environments of
Gymnasium (docs/evidence/ros2-cx.md).
"""
