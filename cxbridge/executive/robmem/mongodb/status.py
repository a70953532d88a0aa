"""The status of a replica set."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SetStatus:
    """How a replica set stands, in the words of MongoDBManagedReplicaSetInterface.

    :param member: what the server is that we work with.
    :param primary: whether there is one that can be written to.
    :param error: what is wrong, in words.
    """

    member: str
    primary: str
    error: str
