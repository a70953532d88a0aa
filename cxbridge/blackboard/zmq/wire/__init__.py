"""Frames, codes of refusals and sockets of the ZeroMQ protocol, without sessions."""
