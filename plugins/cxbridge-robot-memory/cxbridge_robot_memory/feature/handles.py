"""Handles of CLIPS for documents, arrays, cursors and triggers.

Rules refer to such an object by a number, its handle, which CLIPS shows as an external address. A handle is
never reused, because rules may keep the handle of a destroyed object, and must get an error for it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeVar

from cxbridge.errors import ClipsError
from cxbridge.executive.host.values import ExternalAddress, Symbol, Value, value_text
from cxbridge_robot_memory.store import Watch
from cxbridge_robot_memory.values import Document

T = TypeVar("T")

# far above the handles of blackboard messages, so that functions for documents refuse those handles
_FIRST_NUMBER = 1 << 32


class Cursor:
    """The remaining documents of a query."""

    def __init__(self, documents: list[Document]) -> None:
        self.documents: Iterator[Document] = iter(documents)


class Trigger:
    """A registration for changes of a collection.

    :ivar watch: the subscription; None until the database has confirmed the registration.
    """

    def __init__(self) -> None:
        self.watch: Watch | None = None

    def close(self) -> None:
        """Stop the notifications."""
        if self.watch is not None:
            self.watch.close()


_NOUNS: dict[type, str] = {dict: "a document", list: "an array", Cursor: "a cursor", Trigger: "a trigger"}


class Handles:
    """The handles of one environment with their objects."""

    def __init__(self) -> None:
        self._objects: dict[int, object] = {}
        # counted per environment: facts show them, and runs must be reproducible
        self._next_number = _FIRST_NUMBER

    def add(self, new_object: object) -> ExternalAddress:
        """Store an object, and return its new handle."""
        number = self._next_number
        self._next_number += 1
        self._objects[number] = new_object
        return ExternalAddress(number)

    def get(self, address: Value, kind: type[T], function: str) -> T:
        """Return the object of a handle.

        :param kind: the required class of the object.
        :param function: the name of the CLIPS function, for errors.
        :raises ClipsError: if the handle is unknown or the object has another class.
        """
        stored_object = self._objects.get(_number(address))
        if isinstance(stored_object, kind):
            return stored_object
        noun = _NOUNS[kind]
        if stored_object is not None:
            raise ClipsError(f"{function}: this is {_NOUNS[type(stored_object)]}, not {noun}")
        if _FIRST_NUMBER <= _number(address) < self._next_number:
            raise ClipsError(f"{function}: the object was destroyed before")
        raise ClipsError(f"{function}: this is not {noun}: {value_text(address)}")

    def pop(self, address: Value, kind: type[T], function: str) -> T:
        """Return the object of a handle, and release the handle.

        :raises ClipsError: as in :meth:`get`.
        """
        stored_object = self.get(address, kind, function)
        del self._objects[_number(address)]
        return stored_object

    def objects_of_kind(self, kind: type[T]) -> list[T]:
        """Return all objects of a kind."""
        return [stored for stored in self._objects.values() if isinstance(stored, kind)]


def pointer_symbol(address: ExternalAddress) -> Symbol:
    """Return an address as a symbol such as ``0x100000000``, as in the facts of Fawkes."""
    return Symbol(f"{address.handle:#x}")


def _number(address: Value) -> int:
    """Return the number of an address, or of its symbol from :func:`pointer_symbol`; 0 for other values."""
    if isinstance(address, ExternalAddress):
        return address.handle
    if isinstance(address, Symbol) and address.startswith("0x"):
        try:
            return int(address, 16)
        except ValueError:
            return 0
    return 0
