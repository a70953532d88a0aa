"""Delayed events, so that observers learn of an interface's end after listeners learn of its last instance's.

A local blackboard reports the ends in this order. Here, the closing thread reports the end of the instance,
and the thread of events reports the end of the interface, which the server may send first.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from cxbridge_fawkes.network.messages.blackboard import ID_SIZE, TYPE_SIZE
from cxbridge_fawkes.network.messages.fields import pack_text, unpack_text

Call = Callable[[], None]


class InterfaceEndings:
    """Delays the events of an interface while a thread closes an instance.

    :param put: queues a call for the thread of events.
    """

    def __init__(self, put: Callable[[Call], object]) -> None:
        self._put: Final = put
        self._lock = threading.Lock()
        self._closing: dict[tuple[str, str], int] = {}
        self._delayed: dict[tuple[str, str], list[Call]] = {}

    def deliver(self, interface_type: str, interface_id: str, call: Call) -> None:
        """Queue a call, now or after the closing of the interface's instances.

        :param interface_type: the type as received.
        :param interface_id: the id as received.
        """
        key = (interface_type, interface_id)
        with self._lock:
            if key in self._closing:
                self._delayed.setdefault(key, []).append(call)
            else:
                self._put(call)

    @contextmanager
    def delay_events(self, interface_type: str, interface_id: str) -> Iterator[None]:
        """Delay the events of an interface until the end of the block."""
        key = _truncate_name(interface_type, TYPE_SIZE), _truncate_name(interface_id, ID_SIZE)
        with self._lock:
            self._closing[key] = self._closing.get(key, 0) + 1
        try:
            yield
        finally:
            with self._lock:
                self._closing[key] -= 1
                if not self._closing[key]:
                    del self._closing[key]
                    for call in self._delayed.pop(key, ()):
                        self._put(call)


def _truncate_name(name: str, size: int) -> str:
    """Return a name as Fawkes sends it in events, cut to the size of its field."""
    return unpack_text(pack_text(name, size))
