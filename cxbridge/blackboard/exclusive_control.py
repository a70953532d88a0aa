"""Interfaces with exclusive control: the controller, and the final block of a lost writer.

Readers keep the last block of a lost writer. Without a final block, a killed Skiller would appear to run its
skill, with its controller in control, forever.
"""

from __future__ import annotations

from typing import Final

from cxbridge.interfaces.instance import Interface

CONTROLLER: Final = "exclusive_controller"
"""The field with the controller: the serial of a reading instance."""

_STATUS: Final = "status"
_ERROR: Final = "error"
_RUNNING: Final = "S_RUNNING"
_FAILED: Final = "S_FAILED"


def name_controller(instance: Interface, serial: str) -> str:
    """Return the controller as text: its owner, if known, and its serial.

    :param serial: the published serial; empty without controller.
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
    writer.read()
    status = None if schema.field(_STATUS) is None else getattr(writer.get(_STATUS), "name", "")
    if status != _RUNNING and not writer.get(CONTROLLER):
        return
    writer.set(CONTROLLER, "")
    if status == _RUNNING:
        writer.set(_STATUS, _FAILED)
        if schema.field(_ERROR) is not None:
            writer.set(_ERROR, reason)
    writer.write()
