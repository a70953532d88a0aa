"""Translation of a writer's states for senders on the other board.

A Skiller shows the id of the message that it executes, and the serial of its controller. On its own board
these belong to instances of the gateway; senders on the other board know their own ids and serials.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from typing import Final

from cxbridge.blackboard.exclusive_control import ACQUIRE, CONTROLLER, RELEASE
from cxbridge.blackboard.stale_errors import ErrorTracker
from cxbridge.interfaces.instance import STAMP, Interface
from cxbridge.interfaces.message_ids import MESSAGE_ID_MASK, NO_MESSAGE, id_in, id_offset, with_id
from cxbridge.interfaces.schema import FieldSchema


class StateTranslator:
    """Translates an interface's blocks: message ids, serial of the controller, outdated error.

    On the writer's board, a message has another id than for its sender, and the controller is an instance of
    the gateway.

    :param hide: whether the writer appears idle until it works for a sender of this gateway.
    :param sender_of: returns the sender's serial for an instance of the gateway, or None.
    """

    def __init__(
        self, interface_class: type[Interface], *, hide: bool, sender_of: Callable[[str], str | None]
    ) -> None:
        schema = interface_class.SCHEMA
        self._class: Final = interface_class
        self._id_offset: Final = id_offset(schema)
        self._controller: Final = schema.field(CONTROLLER)
        self.hides = hide and self._id_offset is not None and self._controller is not None
        """Whether the writer is shown as idle."""
        self._sender_of: Final = sender_of
        self._error: Final = schema.field("error") if schema.field("skill_string") is not None else None
        self._error_tracker = ErrorTracker()
        # the sender's id by the id on the writer's board; 128 KiB, made for the first message
        self._sender_ids: array[int] | None = None
        self._orders: set[int] = set()  # ids of messages that start work, while the writer is hidden

    def record(self, message_type: str, writer_id: int, sender_id: int) -> None:
        """Record the ids of a sent message on the writer's board and on the sender's."""
        if self._id_offset is None:
            return
        if self._sender_ids is None:
            self._sender_ids = array("H", bytes(2 * (MESSAGE_ID_MASK + 1)))
        self._sender_ids[writer_id & MESSAGE_ID_MASK] = sender_id & MESSAGE_ID_MASK
        if self.hides and message_type not in (ACQUIRE, RELEASE):
            self._orders.add(writer_id)

    def translate(self, block: bytes) -> bytes:
        """Return a writer's block for the other board."""
        if self._id_offset is None:
            return block
        message_id = id_in(block, self._id_offset)
        if self._controller is not None and self._error is not None:
            block = self._with_own_error(block, message_id, self._error)
        sender_id = NO_MESSAGE
        if self._sender_ids is not None and message_id <= MESSAGE_ID_MASK:
            sender_id = self._sender_ids[message_id]
        if self.hides:
            if message_id in self._orders:
                # from now on, the writer's state concerns the senders of this gateway
                self.hides = False
                self._orders.clear()
            else:
                block = self._idle(block)
                message_id = NO_MESSAGE
        if sender_id not in (NO_MESSAGE, message_id):
            block = with_id(block, self._id_offset, sender_id)
        return block if self._controller is None else self._with_controller(block, self._controller)

    def _with_own_error(self, block: bytes, message_id: int, field: FieldSchema) -> bytes:
        """Return the block without the error of an earlier skill string."""
        view = self._class.VIEW.from_buffer_copy(block)
        values = dict(zip(self._class.ACCESSORS, self._class.READ(view), strict=False))
        skill_string, error = (values[name].decode("utf-8", "replace") for name in ("skill_string", "error"))
        failed = values["status"] == getattr(self._class, "S_FAILED", None)
        own_error = self._error_tracker.current_error(message_id, skill_string, error, failed=failed)
        return block if own_error == error else _with_text(block, field, own_error)

    def _idle(self, block: bytes) -> bytes:
        """Return the block of an unused writer with the present controller."""
        idle = bytearray(len(block))
        idle[: STAMP.size] = block[: STAMP.size]
        if self._controller is not None:
            position = _slice(self._controller)
            idle[position] = block[position]
        return bytes(idle)

    def _with_controller(self, block: bytes, field: FieldSchema) -> bytes:
        sender = self._sender_of(self.controller(block))
        return block if sender is None else _with_text(block, field, sender)

    def controller(self, block: bytes) -> str:
        """Return the serial of the controller in a block, or empty."""
        if self._controller is None:
            return ""
        return block[_slice(self._controller)].partition(b"\0")[0].decode("ascii", "replace")


def _slice(field: FieldSchema) -> slice:
    """Return the position of a field in a block."""
    return slice(field.offset, field.offset + field.size)


def _with_text(block: bytes, field: FieldSchema, text: str) -> bytes:
    """Return a block with another text in a string field, cut at the end of the field."""
    data = text.encode()[: field.size - 1].ljust(field.size, b"\0")
    return block[: field.offset] + data + block[field.offset + field.size :]
