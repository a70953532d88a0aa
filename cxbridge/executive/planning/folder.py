"""A temporary folder of a planner, cleaned up even after it is killed."""

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

    :attr:`files` must be inherited by these processes, because it holds the folder's lock. Making a folder
    also removes the folders of killed processes.
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
        """Environment variables that direct temporary files to the folder."""
        return dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(self.path))

    @property
    def files(self) -> tuple[int, ...]:
        """The file descriptors to inherit."""
        return () if sys.platform == "win32" else (self._lock,)

    def close(self) -> None:
        """Remove the folder after its processes have ended. Further calls do nothing."""
        if self._lock >= 0:
            lock, self._lock = self._lock, -1
            os.close(lock)
            shutil.rmtree(self.path, ignore_errors=True)


def _lock(file: int) -> bool | None:
    """Try to lock a file; return success, or None on Windows, which lacks locks."""
    if sys.platform == "win32":
        return None
    try:
        import fcntl  # noqa: PLC0415 - missing on some systems
    except ImportError:
        return None
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _remove_unused(folder: Path) -> None:
    """Remove an unused folder. A folder without a lock is just being made, and stays."""
    if sys.platform == "win32":
        return  # without locks, it may be in use
    with suppress(OSError):  # the folder may belong to another user, or another process may remove it first
        file = os.open(folder / _LOCK, os.O_RDWR | os.O_NOFOLLOW)
        try:
            if _lock(file):
                shutil.rmtree(folder, ignore_errors=True)
        finally:
            os.close(file)
