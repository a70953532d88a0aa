"""Protobuf messages as Fawkes' protobuf_comm exchanges them: frames, ciphers, types, connections.

The format is in ``docs/evidence/protocol-protobuf.md``. Nothing here knows CLIPS.
"""
