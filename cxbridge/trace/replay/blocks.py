"""From the recorded values of an interface, or of a message to it, back to what can be written or sent."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final
from uuid import UUID

from cxbridge.clock import split_us
from cxbridge.errors import InterfaceError, TraceError
from cxbridge.interfaces.instance import STAMP, Interface
from cxbridge.interfaces.message import ClosedPort, Message

_NOBODY: Final = UUID(int=0)
_HINT: Final = "its definition has changed since; --interface-dir DIR names the one of then"


class BlockMaker:
    """Makes blocks of one interface type.

    :param interface_class: the present type.
    """

    def __init__(self, interface_class: type[Interface]) -> None:
        self._names = {field.name for field in interface_class.fields()}
        # an instance on no blackboard: its setters check and lay out the values
        port = ClosedPort(interface_class.SCHEMA.name, _NOBODY)
        self._scratch = interface_class(port, id="", owner="", serial=_NOBODY, writer=True)

    def check(self, values: Mapping[str, Any], uid: str) -> None:
        """Raise when a write does not have the fields that the type has.

        :param uid: ``Type::id`` that was written.
        :raises TraceError: with their names.
        """
        other = [
            f"{problem} {', '.join(sorted(names))}"
            for problem, names in (
                ("only the recording has", values.keys() - self._names),
                ("only the definition has", self._names - values.keys()),
            )
            if names
        ]
        if other:
            raise TraceError(f"the recorded {uid} has other fields: {'; '.join(other)}", hint=_HINT)

    def make(self, values: Mapping[str, Any], time_us: int, uid: str) -> bytes:
        """Return the block with these values.

        :param time_us: its time stamp, microseconds since the epoch.
        :raises TraceError: when a value does not fit.
        """
        try:
            for name, value in values.items():
                self._scratch.set(name, value)
        except InterfaceError as error:
            self.check(values, uid)
            raise TraceError(f"the recorded {uid} does not fit: {error.message}", hint=_HINT) from error
        block = bytearray(self._scratch.to_bytes())
        STAMP.pack_into(block, 0, *split_us(time_us))
        return bytes(block)


def make_message(reader: Interface, kind: str, values: Mapping[str, Any]) -> Message:
    """Return a recorded message, to be sent by ``reader``.

    :raises InterfaceError: when the interface has no such message, or a value does not fit.
    """
    message = reader.create_message(kind)
    for name, value in values.items():
        message.set(name, value)
    return message
