"""Detection of changed skill files.

Polling modification times needs no thread, works on every file system, and concerns only the loaded files,
wherever they are.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from cxbridge.skiller.lua.modulepath import ModulePath, Signature


class ModuleWatch:
    """Watches the files of modules, and the candidates of missing modules.

    :param interval: seconds between two checks.
    :param now: a clock in real seconds, because files change in real time.
    """

    def __init__(self, interval: float = 0.5, now: Callable[[], float] = time.monotonic) -> None:
        self._interval = interval
        self._now = now
        self._due = now() + interval
        self._path = ModulePath(())
        self._known: dict[str, Signature | None] = {}

    def follow(self, path: ModulePath, *, also_before: bool = False) -> None:
        """Watch the files that were requested on ``path``.

        :param also_before: continue to watch the earlier files in their present state.
        """
        before = {name: path.signature(name) for name in self._known} if also_before else {}
        self._path = path
        self._known = before | path.asked
        self._due = self._now() + self._interval

    def look(self) -> list[str]:
        """Return the changed modules; empty before the next check is due."""
        if self._now() < self._due:
            return []
        self._due = self._now() + self._interval
        return [name for name, known in self._known.items() if self._path.signature(name) != known]
