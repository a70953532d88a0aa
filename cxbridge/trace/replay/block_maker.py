"""Conversion of recorded values to blocks of interfaces, and to messages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final
from uuid import UUID

from cxbridge.clock import split_us
from cxbridge.errors import InterfaceError, TraceError
from cxbridge.interfaces.instance import STAMP, Interface
from cxbridge.interfaces.message import ClosedPort

_NO_SERIAL: Final = UUID(int=0)
_DEFINITION_HINT: Final = (
    "the definition of the type has changed since the recording; name the folder of the old definition with "
    "--interface-dir DIR"
)


class BlockMaker:
    """Makes blocks of one interface type."""

    def __init__(self, interface_class: type[Interface]) -> None:
        self._field_names = {field.name for field in interface_class.fields()}
        # an instance without a blackboard, whose setters check the values and place them in the block
        port = ClosedPort(interface_class.SCHEMA.name, _NO_SERIAL)
        self._scratch_instance = interface_class(port, id="", owner="", serial=_NO_SERIAL, writer=True)

    def check_fields(self, values: Mapping[str, Any], uid: str) -> None:
        """Check that a write has the fields of the type.

        :param uid: the written interface, ``Type::id``.
        :raises TraceError: if fields differ.
        """
        differences = [
            f"{problem} {', '.join(sorted(names))}"
            for problem, names in (
                ("only the recording has", values.keys() - self._field_names),
                ("only the definition has", self._field_names - values.keys()),
            )
            if names
        ]
        if differences:
            raise TraceError(
                f"the fields of the recorded {uid} differ: {'; '.join(differences)}", hint=_DEFINITION_HINT
            )

    def make_block(self, values: Mapping[str, Any], time_us: int, uid: str) -> bytes:
        """Return the block with the values; a field without a value keeps the value of the last block.

        :param time_us: the time stamp of the block in microseconds since the epoch.
        :param uid: the written interface, ``Type::id``, for errors.
        :raises TraceError: if a value does not fit, or a field is unknown.
        """
        try:
            for name, value in values.items():
                self._scratch_instance.set(name, value)
        except InterfaceError as error:
            self.check_fields(values, uid)
            raise TraceError(
                f"the recorded {uid} does not fit: {error.message}", hint=_DEFINITION_HINT
            ) from error
        block = bytearray(self._scratch_instance.to_bytes())
        STAMP.pack_into(block, 0, *split_us(time_us))
        return bytes(block)
