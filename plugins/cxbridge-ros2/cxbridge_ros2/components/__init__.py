"""The components of runs and daemons that ROS 2 brings."""
