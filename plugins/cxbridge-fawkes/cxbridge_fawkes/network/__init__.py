"""Fawkes' network protocol: a client of Fawkes' blackboard, and a server for Fawkes' tools.

::

    board = FawkesBlackBoard("fawkes://robot:1910", registry, clock)
    with FawkesServer(local_board, port=1910): ...

docs/evidence/protocol-fawkes.md describes the protocol.
"""
