"""The status of a replica set."""

from __future__ import annotations

from msgspec import Struct


class SetStatus(Struct, frozen=True):
    """How a replica set stands, in the words of MongoDBManagedReplicaSetInterface.

    :param member: what the server is that we work with.
    :param primary: whether there is one that can be written to.
    :param error: what is wrong, in words.
    """

    member: str
    primary: str
    error: str
