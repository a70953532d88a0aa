"""cxbridge: the CLIPS Executive with an emulated Fawkes blackboard, without Fawkes."""

__version__ = "0.1.0"
