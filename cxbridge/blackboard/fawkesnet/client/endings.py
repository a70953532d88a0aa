"""Delays the end of an interface until the ends of its instances were announced, as on a local board."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from cxbridge.blackboard.fawkesnet.messages.blackboard import ID_SIZE, TYPE_SIZE
from cxbridge.blackboard.fawkesnet.messages.fields import pack_text, unpack_text

Call = Callable[[], None]


class Endings:
    """Holds back news of an interface as long as an instance of it is being closed here.

    An instance's end is announced in the thread that closes it, the interface's end in that of the events:
    the server's answer may be quicker than the closing thread.

    :param put: takes calls for the thread of the events.
    """

    def __init__(self, put: Callable[[Call], object]) -> None:
        self._put: Final = put
        self._lock = threading.Lock()
        self._closing: dict[tuple[str, str], int] = {}
        self._held: dict[tuple[str, str], list[Call]] = {}

    def deliver(self, interface_type: str, interface_id: str, call: Call) -> None:
        """Put ``call``, now or when nothing is being closed of the interface; names are the wire's."""
        key = (interface_type, interface_id)
        with self._lock:
            if key in self._closing:
                self._held.setdefault(key, []).append(call)
            else:
                self._put(call)

    @contextmanager
    def closing(self, interface_type: str, interface_id: str) -> Iterator[None]:
        """Hold back news of an interface until the end of the block."""
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
    """Return a name as the news have it: cut when it fills its field."""
    return unpack_text(pack_text(name, size))
