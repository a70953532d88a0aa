"""Interfaces with exclusive control, such as a Skiller's: the controller, its messages, and lost writers.

A Skiller shows three facts to the clients that share it: the controller, the id of the message that it
executes, and the outcome. Two of these can go stale:

- Readers keep the last block of a lost writer. Without a final block, a killed Skiller would appear to run
  its skill, with its controller in control, forever (:func:`write_farewell`).

- Fawkes numbers the messages of each sender from 1. The next message may therefore get the id that the
  interface already shows for another sender, and the sender would take the result of the earlier message for
  the result of the new one. It may also get 0, which means no message. The blackboards of cxbridge leave out
  both ids, see :mod:`~cxbridge.interfaces.message_ids`; with Fawkes, :func:`skip_stale_ids` uses them up.
"""

from __future__ import annotations

from typing import Final

from cxbridge.interfaces.instance import Interface

CONTROLLER: Final = "exclusive_controller"
"""The field with the controller: the serial of a reading instance."""

ACQUIRE: Final = "AcquireControlMessage"
RELEASE: Final = "ReleaseControlMessage"
"""The messages that acquire and release exclusive control."""

_STATUS: Final = "status"
_ERROR: Final = "error"
_RUNNING: Final = "S_RUNNING"
_FAILED: Final = "S_FAILED"


def name_controller(instance: Interface, serial: str) -> str:
    """Return the controller as text: its owner, if known, and its serial.

    :param serial: the published serial of the controller; empty without a controller.
    """
    if not serial:
        return "nobody"
    owner = instance.reader_owner(serial)
    return f"{owner} ({serial})" if owner else serial


def write_farewell(writer: Interface, reason: str) -> None:
    """Clear the controller and mark a running call as failed.

    Finished calls and interfaces without exclusive control stay unchanged.

    :param writer: an instance opened for writing.
    :param reason: the error text of the call.
    :raises BlackBoardError: if writing fails.
    """
    schema = writer.SCHEMA
    if schema.field(CONTROLLER) is None:
        return
    writer.read()  # values that were set but not written belong to no block that readers have
    status = None if schema.field(_STATUS) is None else getattr(writer.get(_STATUS), "name", "")
    if status != _RUNNING and not writer.get(CONTROLLER):
        return
    writer.set(CONTROLLER, "")
    if status == _RUNNING:
        writer.set(_STATUS, _FAILED)
        if schema.field(_ERROR) is not None:
            writer.set(_ERROR, reason)
    writer.write()


def skip_stale_ids(instance: Interface, *, controls: bool) -> int:
    """Send harmless messages until the next id is neither 0 nor the id that the interface shows.

    A Skiller ignores both kinds of message: a controller that acquires again keeps control, and a sender
    without control has nothing to release. Interfaces without control stay unchanged.

    :param controls: whether the instance may have control.
    :returns: the number of messages sent.
    :raises BlackBoardError: if they cannot be sent.
    """
    harmless = ACQUIRE if controls else RELEASE
    if harmless not in instance.MESSAGES:
        return 0
    sent = 0
    while instance.next_id_is_stale:
        instance.msgq_enqueue(instance.create_message(harmless))
        sent += 1
    return sent
