"""Bags of ROS 2 as recorded runs, and recorded runs as bags."""
