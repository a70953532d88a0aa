"""The kit of transports: what all ways to a blackboard share; docs/architecture.md says how to add one."""
