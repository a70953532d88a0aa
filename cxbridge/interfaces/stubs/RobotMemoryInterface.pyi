"""The interface type RobotMemoryInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from cxbridge.interfaces.instance import Interface, Message

class RobotMemoryInterface(Interface):
    """The interface type RobotMemoryInterface.

    The robot memory: documents in collections. Every text is a JSON document.
    """

    class QueryMessage(Message):
        """The message QueryMessage.

        Find documents.
        """

        query: str
        """What the documents must match."""

        collection: str
        """Where to look."""

        def __init__(
            self,
            query: str = "",
            collection: str = "",
        ) -> None: ...

    class InsertMessage(Message):
        """The message InsertMessage.

        Add a document.
        """

        insert: str
        """The document."""

        collection: str
        """Where to add it."""

        def __init__(
            self,
            insert: str = "",
            collection: str = "",
        ) -> None: ...

    class UpdateMessage(Message):
        """The message UpdateMessage.

        Change all documents that match.
        """

        query: str
        """What they must match."""

        update: str
        """The changes."""

        collection: str
        """Where they are."""

        def __init__(
            self,
            query: str = "",
            update: str = "",
            collection: str = "",
        ) -> None: ...

    class RemoveMessage(Message):
        """The message RemoveMessage.

        Drop all documents that match.
        """

        query: str
        """What they must match."""

        collection: str
        """Where they are."""

        def __init__(
            self,
            query: str = "",
            collection: str = "",
        ) -> None: ...

    error: str
    """Why the last message failed; empty when it did not."""

    result: str
    """What the last message found."""
