"""The operations that clients can request: a table for requests, the REST API and prompts.

Each module here with ``OPERATIONS`` adds some; see :mod:`cxbridge.daemon.operations.table`.
"""
