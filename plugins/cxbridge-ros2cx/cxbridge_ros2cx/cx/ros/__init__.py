"""The node's part in ROS: its topics, services and actions, and the messages that rules have."""
