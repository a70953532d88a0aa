"""Fawkes' plugins for planning over the blackboard."""
