"""Plays the interface writes of a recorded run onto a blackboard; docs/recording.md."""
