"""Handles of CLIPS for documents, arrays, cursors and triggers.

Rules refer to such an object by a number, its handle, which CLIPS shows as an external address. A handle is
never reused, because rules may keep the handle of a destroyed object, and must get an error for it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TypeVar

from cxbridge.errors import ClipsError
from cxbridge.events import Logger
from cxbridge.executive.host.values import ExternalAddress, Symbol, Value, show
from cxbridge_robot_memory.store import Watch
from cxbridge_robot_memory.values import Document

T = TypeVar("T")

# far from the handles of messages on the blackboard, so that functions for documents tell them apart
_FIRST_NUMBER = 1 << 32

_MANY_HANDLES = 100_000  # with more handles, rules probably forget to release them


class Cursor:
    """The remaining documents of a query."""

    def __init__(self, documents: list[Document]) -> None:
        self.documents: Iterator[Document] = iter(documents)


class Trigger:
    """A registration for changes of a collection.

    :param name: the name of the facts about the changes.
    :ivar watch: the subscription; None until the database has confirmed the registration.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.watch: Watch | None = None

    def close(self) -> None:
        """Stop the notifications."""
        if self.watch is not None:
            self.watch.close()


class Handles:
    """The handles of one environment with their objects.

    :param log: gets a warning at a suspiciously large number of objects.
    """

    def __init__(self, log: Logger) -> None:
        self._objects: dict[int, object] = {}
        # counted per environment: facts show them, and runs must be reproducible
        self._numbers = itertools.count(_FIRST_NUMBER)
        self._log = log
        self._warn_at = _MANY_HANDLES

    def add(self, value: object) -> ExternalAddress:
        """Return a new handle of an object."""
        number = next(self._numbers)
        self._objects[number] = value
        if len(self._objects) >= self._warn_at:
            self._log.warn(
                f"{len(self._objects)} documents and cursors are alive in CLIPS: "
                "does a rule forget bson-destroy or robmem-cursor-destroy?"
            )
            self._warn_at *= 2
        return ExternalAddress(number)

    def get(self, address: Value, kind: type[T], function: str) -> T:
        """Return the object of a handle.

        :param kind: the required class of the object.
        :param function: the name of the CLIPS function, for errors.
        :raises ClipsError: if the handle is unknown or the object has another class.
        """
        value = self._objects.get(_number(address))
        if isinstance(value, kind):
            return value
        noun = _class_noun(kind)
        if value is not None:
            actual_noun = _class_noun(type(value))
            raise ClipsError(f"{function}: this is {_with_article(actual_noun)}, not {_with_article(noun)}")
        if _number(address) >= _FIRST_NUMBER:
            raise ClipsError(f"{function}: this {noun} was destroyed before")
        raise ClipsError(f"{function}: this is not {_with_article(noun)}: {show(address)}")

    def pop(self, address: Value, kind: type[T], function: str) -> T:
        """Return the object of a handle, and release the handle.

        :raises ClipsError: as in :meth:`get`.
        """
        value = self.get(address, kind, function)
        del self._objects[_number(address)]
        return value

    def objects_of_kind(self, kind: type[T]) -> list[T]:
        """Return all objects of a kind."""
        return [value for value in self._objects.values() if isinstance(value, kind)]


def _class_noun(kind: type) -> str:
    """Return the noun for a class, for messages."""
    return {"dict": "document", "list": "array"}.get(kind.__name__, kind.__name__.lower())


def _with_article(noun: str) -> str:
    return f"an {noun}" if noun == "array" else f"a {noun}"


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
