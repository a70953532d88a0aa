"""What transports of the blackboard have in common; docs/architecture.md says how to add one."""
