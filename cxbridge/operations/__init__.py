"""The operations that clients can ask a daemon for: one table behind its requests, its REST API and a prompt.

Each module here that has ``OPERATIONS`` adds some; see :mod:`cxbridge.operations.table`.
"""
