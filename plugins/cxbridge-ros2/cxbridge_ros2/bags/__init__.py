"""Bags, the recordings of ROS 2 (rosbag2), as recorded runs of cxbridge, and the reverse."""
