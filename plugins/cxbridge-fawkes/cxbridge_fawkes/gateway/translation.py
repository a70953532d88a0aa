"""Translation of a Skiller's blocks for the senders on the other board of a gateway.

A Skiller's interface shows the id of the message in execution, and the serial of the controller. The gateway
sends the messages of the other board's senders through its own instances, so the Skiller shows the ids and
serials of these instances. The senders need their own ids and serials instead.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from typing import Final

from cxbridge.blackboard.exclusive_control import ACQUIRE_MESSAGE, CONTROLLER_FIELD, RELEASE_MESSAGE
from cxbridge.blackboard.stale_errors import ErrorTracker
from cxbridge.interfaces.instance import STAMP, Interface
from cxbridge.interfaces.message_ids import MESSAGE_ID_MASK, NO_MESSAGE, id_offset, read_id, replace_id
from cxbridge.interfaces.schema import FieldSchema


class BlockTranslator:
    """Replaces message ids, serials of controllers, and errors of earlier skill strings in blocks.

    :param hide_state: whether the writer appears idle until it works for a sender of this gateway.
    :param find_sender_serial: called with the serial of an instance; returns the serial of the sender for
        which this instance of the gateway sends, None for an instance that does not belong to the gateway.
    """

    def __init__(
        self,
        interface_class: type[Interface],
        *,
        hide_state: bool,
        find_sender_serial: Callable[[str], str | None],
    ) -> None:
        schema = interface_class.SCHEMA
        self._class: Final = interface_class
        self._id_offset: Final = id_offset(schema)
        self._controller_field: Final = schema.field(CONTROLLER_FIELD)
        self.hides_state = hide_state and self._id_offset is not None and self._controller_field is not None
        """Whether the writer is shown as idle."""
        self._find_sender_serial: Final = find_sender_serial
        self._error_field: Final = schema.field("error") if schema.field("skill_string") is not None else None
        self._error_tracker = ErrorTracker()
        # the sender's id by the id on the writer's board: 128 KiB for an interface that shows ids
        id_count = 0 if self._id_offset is None else MESSAGE_ID_MASK + 1
        self._sender_ids = array("H", bytes(2 * id_count))
        self._work_ids: set[int] = set()  # the messages that start work, while the state is hidden

    def record_ids(self, message_type: str, writer_id: int, sender_id: int) -> None:
        """Record the ids that a sent message has on the writer's board and on the sender's board."""
        if self._id_offset is None:
            return
        self._sender_ids[writer_id & MESSAGE_ID_MASK] = sender_id & MESSAGE_ID_MASK
        if self.hides_state and message_type not in (ACQUIRE_MESSAGE, RELEASE_MESSAGE):
            self._work_ids.add(writer_id)

    def translate(self, block: bytes) -> bytes:
        """Return a writer's block for the other board."""
        if self._id_offset is None:
            return block
        message_id = read_id(block, self._id_offset)
        if self._controller_field is not None and self._error_field is not None:
            block = self._replace_stale_error(block, message_id, self._error_field)
        # an instance counts its messages with 16 bits, so a larger id belongs to no sender
        sender_id = self._sender_ids[message_id] if message_id <= MESSAGE_ID_MASK else NO_MESSAGE
        if self.hides_state:
            if message_id in self._work_ids:
                # the writer works for a sender of this gateway, so that senders see its state from now on
                self.hides_state = False
                self._work_ids.clear()
            else:
                block = self._make_idle_block(block)
                message_id = NO_MESSAGE
        if sender_id not in (NO_MESSAGE, message_id):
            block = replace_id(block, self._id_offset, sender_id)
        sender_serial = self._find_sender_serial(self.read_controller(block))
        if self._controller_field is None or sender_serial is None:
            return block  # there is no controller, or one that does not send through the gateway
        return _replace_text(block, self._controller_field, sender_serial)

    def _replace_stale_error(self, block: bytes, message_id: int, field: FieldSchema) -> bytes:
        """Return the block with the error of the present skill string, not of an earlier skill string."""
        view = self._class.VIEW.from_buffer_copy(block)
        # not strict: READ_FIELDS appends padding values, for which ACCESSORS has no names
        values = dict(zip(self._class.ACCESSORS, self._class.READ_FIELDS(view), strict=False))
        skill_string, error = (values[name].decode("utf-8", "replace") for name in ("skill_string", "error"))
        failed = values["status"] == getattr(self._class, "S_FAILED", None)
        current_error = self._error_tracker.update(message_id, skill_string, error, failed=failed)
        return block if current_error == error else _replace_text(block, field, current_error)

    def _make_idle_block(self, block: bytes) -> bytes:
        """Return the block of an idle writer, with time stamp and controller of the present block."""
        idle_block = bytearray(len(block))
        idle_block[: STAMP.size] = block[: STAMP.size]
        if self._controller_field is not None:
            controller_slice = _field_slice(self._controller_field)
            idle_block[controller_slice] = block[controller_slice]
        return bytes(idle_block)

    def read_controller(self, block: bytes) -> str:
        """Return the serial of the controller in a block; empty without a controller."""
        if self._controller_field is None:
            return ""
        return block[_field_slice(self._controller_field)].partition(b"\0")[0].decode("ascii", "replace")


def _field_slice(field: FieldSchema) -> slice:
    """Return the slice of a field in a block."""
    return slice(field.offset, field.offset + field.size)


def _replace_text(block: bytes, field: FieldSchema, text: str) -> bytes:
    """Return a block with another text in a string field, cut to the bytes that the field has."""
    padded_text = text.encode()[: field.size - 1].ljust(field.size, b"\0")  # room for the NUL of a C string
    return block[: field.offset] + padded_text + block[field.offset + field.size :]
