"""Errors of opened interfaces, messages and message queues, in the words of Fawkes.

:mod:`cxbridge.blackboard.errors` shows their tree. The errors are in this package because
instances raise them, and interfaces do not depend on the blackboard.
"""

from __future__ import annotations

from cxbridge.errors import BlackBoardError


class InstanceError(BlackBoardError):
    """An opened interface refuses an operation."""


class WriteDeniedError(InstanceError):
    """A reader was used for an operation of writers."""

    def __init__(self, interface_type: str, interface_id: str, reason: str) -> None:
        super().__init__(
            f"This interface instance '{interface_id}' of type '{interface_type}' "
            f"is not opened for writing. {reason}"
        )


class QueueAccessError(WriteDeniedError):
    """A reader was used for an operation of the message queue."""

    def __init__(self, interface_type: str, interface_id: str, operation: str) -> None:
        super().__init__(
            interface_type,
            interface_id,
            f"Cannot work on message queue on reading instance of an interface ({operation}).",
        )


class EnqueueDeniedError(InstanceError):
    """A message was enqueued on a writer instead of a reader."""

    def __init__(self, interface_type: str, interface_id: str) -> None:
        super().__init__(
            f"This interface instance '{interface_id}' of type '{interface_type}' IS opened for writing, "
            "but messages can only be enqueued on reading interfaces."
        )


class InvalidInstanceError(InstanceError):
    """The instance was closed, or its blackboard was shut down."""

    def __init__(self, uid: str, serial: object, operation: str) -> None:
        super().__init__(
            f"The interface {uid} (instance serial {serial}) is invalid. You cannot call {operation} anymore."
        )


class TimestampError(InstanceError):
    """An explicit time stamp was set on a reader, or while time stamps are automatic."""


class MessageError(BlackBoardError):
    """A message cannot be made, sent or queued."""


class ForeignMessageError(MessageError):
    """The message belongs to another interface type."""

    def __init__(self, message_type: str, interface_type: str) -> None:
        super().__init__(
            f"Message of type '{message_type}' cannot be enqueued in interface of type '{interface_type}'"
        )


class UnknownMessageTypeError(MessageError):
    """The interface type has no message of this name."""

    def __init__(self, message_type: str, message_types: tuple[str, ...]) -> None:
        super().__init__(
            f"The given type '{message_type}' does not match any known message type for this interface type.",
            hint=f"it has {', '.join(message_types)}" if message_types else "it has no messages",
        )


class MessageAlreadyQueuedError(MessageError):
    """The message object was queued before; send a copy or a new message."""

    def __init__(self) -> None:
        super().__init__(
            "Message already enqueued in another MessageQueue.",
            hint="make a new message for each call, or use msgq_enqueue_copy",
        )


class QueueFullError(MessageError):
    """The bounded queue of the writer is full."""

    def __init__(self, uid: str, limit: int) -> None:
        super().__init__(f"The message queue of interface {uid} is full ({limit} messages).")
        self.limit = limit
