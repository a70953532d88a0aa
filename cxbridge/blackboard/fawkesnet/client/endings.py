"""Delays the end of an interface until the ends of its instances are reported, as on a local blackboard."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from cxbridge.blackboard.fawkesnet.messages.blackboard import ID_SIZE, TYPE_SIZE
from cxbridge.blackboard.fawkesnet.messages.fields import pack_text, unpack_text

Call = Callable[[], None]


class Endings:
    """Holds back events of an interface while an instance is being closed.

    The closing thread reports the end of an instance, the thread of events reports the end of the interface,
    which the server may send before the closing thread has finished.

    :param put: queues a call for the thread of events.
    """

    def __init__(self, put: Callable[[Call], object]) -> None:
        self._put: Final = put
        self._lock = threading.Lock()
        self._closing: dict[tuple[str, str], int] = {}
        self._held: dict[tuple[str, str], list[Call]] = {}

    def deliver(self, interface_type: str, interface_id: str, call: Call) -> None:
        """Queue a call, now or after the closing of the interface's instances. Names are as on the wire."""
        key = (interface_type, interface_id)
        with self._lock:
            if key in self._closing:
                self._held.setdefault(key, []).append(call)
            else:
                self._put(call)

    @contextmanager
    def closing(self, interface_type: str, interface_id: str) -> Iterator[None]:
        """Hold back the events of an interface in this block."""
        key = _on_the_wire(interface_type, TYPE_SIZE), _on_the_wire(interface_id, ID_SIZE)
        with self._lock:
            self._closing[key] = self._closing.get(key, 0) + 1
        try:
            yield
        finally:
            with self._lock:
                self._closing[key] -= 1
                if not self._closing[key]:
                    del self._closing[key]
                    for call in self._held.pop(key, ()):
                        self._put(call)


def _on_the_wire(name: str, size: int) -> str:
    """Return a name as in events: cut if it fills its field."""
    return unpack_text(pack_text(name, size))
