"""Agents of the two CLIPS Executives for ROS 2, without ROS.

The thesis' executive is fawkesrobotics/ros2-clips-executive (2021). The modules of this package run a
checkout of it: its parameter files, features and executors (docs/evidence/ros2cx.md). The ROS 2 CX is its
successor, carologistics/clips_executive. The package ``cx`` runs its node ``clips_manager``, and the package
``rl`` makes its learning agents environments of Gymnasium (docs/evidence/ros2-cx.md).
"""
