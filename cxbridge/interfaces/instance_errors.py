"""The errors of opened interfaces, messages and message queues, with the words Fawkes uses.

They are :class:`~cxbridge.errors.BlackBoardError`; :mod:`cxbridge.blackboard.errors` shows the whole tree.
They live here because instances raise them, and interfaces know nothing of the blackboard.
"""

from __future__ import annotations

from cxbridge.errors import BlackBoardError


class InstanceError(BlackBoardError):
    """An opened interface refuses an operation."""


class WriteDeniedError(InstanceError):
    """Something only a writer may do was asked of a reader."""

    def __init__(self, interface_type: str, interface_id: str, reason: str) -> None:
        super().__init__(
            f"This interface instance '{interface_id}' of type '{interface_type}' "
            f"is not opened for writing. {reason}"
        )


class QueueAccessError(WriteDeniedError):
    """The message queue of a reader was touched; only writers have one."""

    def __init__(self, interface_type: str, interface_id: str, operation: str) -> None:
        super().__init__(
            interface_type,
            interface_id,
            f"Cannot work on message queue on reading instance of an interface ({operation}).",
        )


class EnqueueDeniedError(InstanceError):
    """A message was enqueued on a writer; messages go from readers to the writer."""

    def __init__(self, interface_type: str, interface_id: str) -> None:
        super().__init__(
            f"This interface instance '{interface_id}' of type '{interface_type}' IS opened for writing, "
            "but messages can only be enqueued on reading interfaces."
        )


class InvalidInstanceError(InstanceError):
    """The instance was closed, or its blackboard is gone."""

    def __init__(self, uid: str, serial: object, operation: str) -> None:
        super().__init__(
            f"The interface {uid} (instance serial {serial}) is invalid. You cannot call {operation} anymore."
        )


class TimestampError(InstanceError):
    """An explicit time stamp was set on a reader or in spite of automatic time stamps."""


class BufferIndexError(InstanceError, IndexError):
    """There is no private buffer of this number."""

    def __init__(self, uid: str, index: int, size: int) -> None:
        buffers = f"{size} buffers: use 0..{size - 1}" if size else "no buffers: call resize_buffers first"
        super().__init__(f"Buffer ID out of bounds: {index}", hint=f"{uid} has {buffers}")


class MessageError(BlackBoardError):
    """A message cannot be made, sent or queued."""


class InvalidMessageError(MessageError):
    """The message belongs to another interface type."""

    def __init__(self, message_type: str, interface_type: str) -> None:
        super().__init__(
            f"Message of type '{message_type}' cannot be enqueued in interface of type '{interface_type}'"
        )


class UnknownMessageTypeError(MessageError):
    """The interface type has no message of this name."""

    def __init__(self, message_type: str, known: tuple[str, ...]) -> None:
        super().__init__(
            f"The given type '{message_type}' does not match any known message type for this interface type.",
            hint=f"it has {', '.join(known)}" if known else "it has no messages",
        )


class MessageAlreadyQueuedError(MessageError):
    """The message object is, or was, in a queue; send a copy or a new one."""

    def __init__(self) -> None:
        super().__init__(
            "Message already enqueued in another MessageQueue.",
            hint="make a new message for each one that you send, or use msgq_enqueue_copy",
        )


class QueueFullError(MessageError):
    """The writer's queue is bounded and holds as many messages as it may."""

    def __init__(self, uid: str, limit: int) -> None:
        super().__init__(f"The message queue of interface {uid} is full ({limit} messages).")
        self.limit = limit


class WrongMessageError(MessageError):
    """The first message in the queue is of another type than the caller asked for."""

    def __init__(self) -> None:
        super().__init__("Message is not of desired type")
