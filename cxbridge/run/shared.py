"""Objects that plug-ins share within a run or a team."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Any, TypeVar

from cxbridge.closing import Closing

Owner = TypeVar("Owner")
T = TypeVar("T")


class SharedObjects(Closing):
    """Objects by the functions that make them.

    :meth:`close` closes the objects that are :class:`~cxbridge.closing.Closing`, the latest first.
    """

    def __init__(self) -> None:
        self._objects: dict[Callable[..., Any], Any] = {}
        self._undo = ExitStack()

    def get_or_make(self, make: Callable[[Owner], T], owner: Owner) -> T:
        """Return the object that ``make`` has made; the first call makes the object.

        :param owner: the argument of ``make``: the run or the team. Later calls do not use it.
        """
        if make not in self._objects:
            self._objects[make] = new_object = make(owner)
            if isinstance(new_object, Closing):
                self._undo.callback(new_object.close)
        shared: T = self._objects[make]
        return shared

    def close(self) -> None:
        self._undo.close()
