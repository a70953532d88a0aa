"""The node's interface to ROS: topics, services, actions, and the messages of rules."""
