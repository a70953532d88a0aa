"""Interfaces with exclusive control: which client has it, and the last block of a writer that leaves.

Readers keep the last block of a writer that is gone. A Skiller that is killed in the middle of a skill would
show the skill as running, and its controller in control, until the end of all time.
"""

from __future__ import annotations

from typing import Final

from cxbridge.interfaces.instance import Interface

CONTROLLER: Final = "exclusive_controller"
"""The field that shows the writer's exclusive controller: the serial of a reading instance."""

_STATUS: Final = "status"
_ERROR: Final = "error"
_RUNNING: Final = "S_RUNNING"
_FAILED: Final = "S_FAILED"


def name_controller(instance: Interface, serial: str) -> str:
    """Return the client with exclusive control for people: its owner, if that is known, and its serial.

    :param instance: of the interface.
    :param serial: the serial that the interface shows; empty: no client has control.
    """
    if not serial:
        return "nobody"
    owner = instance.reader_owner(serial)
    return f"{owner} ({serial})" if owner else serial


def write_farewell(writer: Interface, reason: str) -> None:
    """Write that no client has control, and that the call under way has failed.

    A finished call does not change, and neither does an interface without exclusive control.

    :param writer: opened for writing.
    :param reason: why the call has failed, for people.
    :raises BlackBoardError: when the blackboard cannot be written.
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
