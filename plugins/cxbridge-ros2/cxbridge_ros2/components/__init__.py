"""The components of runs and daemons for ROS 2."""
