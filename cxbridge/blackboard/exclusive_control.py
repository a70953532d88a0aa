"""Interfaces with exclusive control, such as SkillerInterface: controller, messages, and lost writers.

The controller is the one client whose skills a Skiller executes. The interface shows the controller, the id
of the message in execution, and the outcome. The shown values can be stale in two ways:

- Readers keep the last block of a lost writer. Without a final block, a killed Skiller would appear to run
  its skill forever, and its controller to have control (:func:`write_final_block`).

- Fawkes numbers the messages of each sender from 1. The next message of a sender may therefore get the id
  that the interface shows for another sender's message, and the sender would mistake the result of that
  message for the result of the new message. The next message may also get the id 0, which means no message.
  The blackboards of cxbridge skip both ids, see :mod:`~cxbridge.interfaces.message_ids`; for Fawkes,
  :func:`skip_stale_ids` uses them up.
"""

from __future__ import annotations

from typing import Final

from cxbridge.interfaces.instance import Interface

CONTROLLER_FIELD: Final = "exclusive_controller"
"""The field with the controller: the serial of a reading instance."""

ACQUIRE_MESSAGE: Final = "AcquireControlMessage"
"""The message that acquires exclusive control."""

RELEASE_MESSAGE: Final = "ReleaseControlMessage"
"""The message that releases exclusive control."""

_STATUS_FIELD: Final = "status"
_ERROR_FIELD: Final = "error"
_RUNNING_STATUS: Final = "S_RUNNING"
_FAILED_STATUS: Final = "S_FAILED"


def describe_controller(instance: Interface, serial: str) -> str:
    """Return the controller as text: its owner, if known, and its serial; a fixed word for no controller.

    :param serial: the serial that the interface shows as its controller; empty without a controller.
    """
    if not serial:
        return "nobody"
    owner = instance.reader_owner(serial)
    return f"{owner} ({serial})" if owner else serial


def write_final_block(writer: Interface, reason: str) -> None:
    """Clear the controller and mark a running call as failed.

    The outcome of a finished call stays, and interfaces without exclusive control stay unchanged.

    :param writer: an instance opened for writing.
    :param reason: the error text of a running call.
    :raises BlackBoardError: if writing fails.
    """
    schema = writer.SCHEMA
    if schema.field(CONTROLLER_FIELD) is None:
        return
    writer.read()  # discards values that were set but never written, which readers do not have
    status = None if schema.field(_STATUS_FIELD) is None else getattr(writer.get(_STATUS_FIELD), "name", "")
    if status != _RUNNING_STATUS and not writer.get(CONTROLLER_FIELD):
        return
    writer.set(CONTROLLER_FIELD, "")
    if status == _RUNNING_STATUS:
        writer.set(_STATUS_FIELD, _FAILED_STATUS)
        if schema.field(_ERROR_FIELD) is not None:
            writer.set(_ERROR_FIELD, reason)
    writer.write()


def skip_stale_ids(instance: Interface, *, may_control: bool) -> int:
    """Send messages without effect until the next id is neither 0 nor the id that the interface shows.

    An AcquireControlMessage of the controller and a ReleaseControlMessage of another sender change nothing.
    An interface without these messages gets none.

    :param may_control: whether the instance may be the controller; without a controller, a message sent makes
        the instance the controller.
    :returns: the number of messages sent.
    :raises BlackBoardError: if a message cannot be sent.
    """
    message_type = ACQUIRE_MESSAGE if may_control else RELEASE_MESSAGE
    if message_type not in instance.MESSAGES:
        return 0
    sent_count = 0
    while instance.next_id_is_stale:
        instance.msgq_enqueue(instance.create_message(message_type))
        sent_count += 1
    return sent_count
