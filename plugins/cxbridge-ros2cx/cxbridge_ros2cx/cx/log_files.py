"""The log file of an environment in the layout of the ROS 2 CX: ``[DATE TIME] [ENV] [LEVEL] TEXT``."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Final, TextIO

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.errors import TraceError
from cxbridge.events import Level

_LEVEL_NAME: Final = "info"  # the ROS 2 CX writes this level into each line, whatever the line's level

_BUFFER_BYTES: Final = 1 << 16  # far above the default, since an agent may log thousands of lines a second


class EnvironmentLog:
    """Writes the lines of an environment into a file.

    :param name: the name of the environment, and of the file without its suffix.
    :param clock: the clock for time stamps, which are in UTC for a virtual clock, otherwise in local time.
    :raises TraceError: if the file is not writable.
    """

    def __init__(self, folder: Path, name: str, clock: Clock) -> None:
        self._name, self._clock = name, clock
        self._second, self._second_text = -1, ""
        file = folder / f"{name}.log"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file: TextIO = file.open(
                "w", encoding="utf-8", errors="surrogateescape", buffering=_BUFFER_BYTES
            )
        except OSError as error:
            raise TraceError(f"cannot write the log: {error.strerror}", file=file) from error

    def write(self, _level: Level, line: str) -> None:
        # the text of a second is kept, since formatting the text for each line is slow
        second, microseconds = divmod(self._clock.now_us(), MICROSECONDS)
        if second != self._second:
            # UTC for virtual times, so that a run has equal files in each time zone
            calendar = time.gmtime(second) if self._clock.is_virtual else time.localtime(second)
            self._second, self._second_text = second, time.strftime("%Y-%m-%d %H:%M:%S", calendar)
        self._file.write(
            f"[{self._second_text}.{microseconds // 1000:03}] [{self._name}] [{_LEVEL_NAME}] {line}\n"
        )

    def close(self) -> None:
        self._file.close()
