"""A store whose answers a test controls."""

from __future__ import annotations

import threading

from cxbridge_robot_memory.embedded import EmbeddedStore
from cxbridge_robot_memory.errors import UnreachableError

WAIT = 30


class ControlledStore(EmbeddedStore):
    """A store that answers, delays its answers (``slow``), or cannot be reached (``away``)."""

    def __init__(self, clock):
        super().__init__(clock)
        self.state = ""
        self.go = threading.Event()

    def set_state(self, state):
        self.state = state
        self.is_local = state != "slow"

    def _wait(self):
        if self.state == "away":
            raise UnreachableError("the server is absent")
        if self.state == "slow":
            assert self.go.wait(WAIT)

    def insert(self, *args, **options):
        self._wait()
        return super().insert(*args, **options)

    def update(self, *args, **options):
        self._wait()
        return super().update(*args, **options)

    def find_one_and_update(self, *args, **options):
        self._wait()
        return super().find_one_and_update(*args, **options)

    def remove(self, *args, **options):
        self._wait()
        return super().remove(*args, **options)

    def watch(self, *args, **options):
        self._wait()
        return super().watch(*args, **options)
