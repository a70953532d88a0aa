"""The components of the server, as in Fawkes: blackboard, configuration, network logger, plugin manager."""
