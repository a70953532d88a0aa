"""A store that answers when a test lets it."""

from __future__ import annotations

import threading

from cxbridge_robot_memory.embedded import EmbeddedStore
from cxbridge_robot_memory.errors import UnreachableError

WAIT = 30


class MoodyStore(EmbeddedStore):
    """A store that answers, does not answer yet, or cannot be reached."""

    def __init__(self, clock):
        super().__init__(clock)
        self.mood = ""
        self.go = threading.Event()

    def be(self, mood):
        self.mood = mood
        self.is_local = mood != "slow"

    def _answer(self):
        if self.mood == "away":
            raise UnreachableError("the server is absent")
        if self.mood == "slow":
            assert self.go.wait(WAIT)

    def insert(self, *args, **options):
        self._answer()
        return super().insert(*args, **options)

    def update(self, *args, **options):
        self._answer()
        return super().update(*args, **options)

    def find_one_and_update(self, *args, **options):
        self._answer()
        return super().find_one_and_update(*args, **options)

    def remove(self, *args, **options):
        self._answer()
        return super().remove(*args, **options)

    def watch(self, *args, **options):
        self._answer()
        return super().watch(*args, **options)
