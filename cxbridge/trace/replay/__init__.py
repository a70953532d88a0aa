"""Replay of a recorded run's interface writes on a blackboard; docs/recording.md."""
