"""The ZeroMQ protocol without sessions: bytes of frames, codes of refusals, sockets."""
