"""Protobuf messages for agents, compatible with protobuf_comm, the library that Fawkes uses.

``docs/evidence/protocol-protobuf.md`` describes the protocol: frames, ciphers, types and connections. Only
the modules :mod:`~cxbridge_protobuf.feature` and :mod:`~cxbridge_protobuf.fields` depend on CLIPS.
"""
