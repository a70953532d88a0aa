"""Notices when a file of the skills changes.

Modification times are asked for now and then. That needs no thread, works on every file system, and concerns
the files that were loaded, wherever they lie, instead of whole folders.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from cxbridge.skiller.lua.modulepath import ModulePath, Signature


class ModuleWatch:
    """Watches the files of modules, and the places where modules were not found.

    :param interval: seconds between two looks.
    :param now: a clock of real seconds: files change in real time, whatever the run's clock does.
    """

    def __init__(self, interval: float = 0.5, now: Callable[[], float] = time.monotonic) -> None:
        self._interval = interval
        self._now = now
        self._due = now() + interval
        self._path = ModulePath(())
        self._known: dict[str, Signature | None] = {}

    def follow(self, path: ModulePath, *, also_before: bool = False) -> None:
        """Watch the files that were looked for on ``path``.

        :param also_before: continue to watch the earlier files, in their present state.
        """
        before = {name: path.signature(name) for name in self._known} if also_before else {}
        self._path = path
        self._known = before | path.asked
        self._due = self._now() + self._interval

    def look(self) -> list[str]:
        """Return the names of the changed modules; none when it is not time to look."""
        if self._now() < self._due:
            return []
        self._due = self._now() + self._interval
        return [name for name, known in self._known.items() if self._path.signature(name) != known]
