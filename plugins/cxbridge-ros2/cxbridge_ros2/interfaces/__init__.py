"""Interfaces of the blackboard as topics of ROS 2, and their definitions as a ROS package."""
