"""Protobuf messages compatible with Fawkes' protobuf_comm: frames, ciphers, types, connections.

The format is in ``docs/evidence/protocol-protobuf.md``. Only :mod:`~cxbridge_protobuf.feature` and ``fields``
know CLIPS.
"""
