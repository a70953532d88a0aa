"""The operations that clients can request: a table for requests, the REST API and prompts.

Each module of this package with ``OPERATIONS`` adds operations; see :mod:`cxbridge.daemon.operations.table`.
"""
