"""The command ros2."""
