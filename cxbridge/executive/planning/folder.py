"""A folder for the temporary files of an engine, which leaves them behind when it is killed."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Final

PREFIX: Final = "cxbridge-planner-"
_LOCK: Final = "in-use"


class EngineFolder:
    """A folder that exists as long as the processes that use it.

    The owner of :attr:`files` holds its lock: this process, and those that it hands them to. The folders
    of killed processes are removed when the next folder is made.
    """

    def __init__(self) -> None:
        base = Path(tempfile.gettempdir())
        for other in base.glob(f"{PREFIX}*"):
            _remove_unused(other)
        self.path = Path(tempfile.mkdtemp(prefix=PREFIX, dir=base))
        self._lock = os.open(self.path / _LOCK, os.O_CREAT | os.O_RDWR, 0o600)
        _lock(self._lock)

    @property
    def environment(self) -> dict[str, str]:
        """What makes a process put its temporary files there."""
        return dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(self.path))

    @property
    def files(self) -> tuple[int, ...]:
        """The file descriptors that a process must inherit."""
        return () if sys.platform == "win32" else (self._lock,)

    def close(self) -> None:
        """Remove it; the processes must be gone. A second call does nothing."""
        if self._lock >= 0:
            lock, self._lock = self._lock, -1
            os.close(lock)
            shutil.rmtree(self.path, ignore_errors=True)


def _lock(file: int) -> bool | None:
    """Lock a file; return whether no other process has, None where there are no locks (Windows)."""
    if sys.platform == "win32":
        return None
    try:
        import fcntl  # noqa: PLC0415 - not every system has it
    except ImportError:
        return None
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _remove_unused(folder: Path) -> None:
    """Remove an unused folder; one that is just being made has no lock yet, and stays."""
    if sys.platform == "win32":
        return  # it may be in use
    with suppress(OSError):  # another user's, or another process is faster
        file = os.open(folder / _LOCK, os.O_RDWR | os.O_NOFOLLOW)
        try:
            if _lock(file):
                shutil.rmtree(folder, ignore_errors=True)
        finally:
            os.close(file)
