"""The daemon: blackboard, transports, Skiller and executive as one long-lived process."""
