"""The interface type MongoDBManagedReplicaSetInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from enum import IntEnum
from typing import ClassVar

from cxbridge.interfaces.instance import Interface

class MongoDBManagedReplicaSetInterface(Interface):
    """The interface type MongoDBManagedReplicaSetInterface.

    State of a replica set that keeps the robot memory of several robots equal.
    """

    class ReplicaSetMemberStatus(IntEnum):
        """Values of type ReplicaSetMemberStatus.

        What the managed database process is within its replica set.
        """

        UNKNOWN = 0
        """Nobody has looked yet."""

        PRIMARY = 1
        """It takes the writes of the set."""

        SECONDARY = 2
        """It follows the primary."""

        ARBITER = 3
        """It votes and holds no data."""

        NOT_INITIALIZED = 4
        """It runs, and waits for the set to be made or to be taken in."""

        INITIALIZING = 5
        """It is copying the data, or recovers."""

        INVALID_CONFIG = 6
        """The set's configuration is of no use; somebody has to repair it."""

        REMOVED = 7
        """The set no longer counts it as a member."""

        ERROR = 8
        """Its state could not be understood."""

    UNKNOWN: ClassVar[ReplicaSetMemberStatus]
    PRIMARY: ClassVar[ReplicaSetMemberStatus]
    SECONDARY: ClassVar[ReplicaSetMemberStatus]
    ARBITER: ClassVar[ReplicaSetMemberStatus]
    NOT_INITIALIZED: ClassVar[ReplicaSetMemberStatus]
    INITIALIZING: ClassVar[ReplicaSetMemberStatus]
    INVALID_CONFIG: ClassVar[ReplicaSetMemberStatus]
    REMOVED: ClassVar[ReplicaSetMemberStatus]
    ERROR: ClassVar[ReplicaSetMemberStatus]

    class ReplicaSetPrimaryStatus(IntEnum):
        """Values of type ReplicaSetPrimaryStatus.

        Whether the set can be written to.
        """

        PRIMARY_UNKNOWN = 0
        """That could not be found out."""

        HAVE_PRIMARY = 1
        """One member is the primary."""

        NO_PRIMARY = 2
        """There is no primary; an election comes next."""

    PRIMARY_UNKNOWN: ClassVar[ReplicaSetPrimaryStatus]
    HAVE_PRIMARY: ClassVar[ReplicaSetPrimaryStatus]
    NO_PRIMARY: ClassVar[ReplicaSetPrimaryStatus]

    member_status: ReplicaSetMemberStatus
    """What the own process is."""

    primary_status: ReplicaSetPrimaryStatus
    """Whether there is a primary."""

    error_msg: str
    """What went wrong, in words."""
