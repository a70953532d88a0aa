"""The log file of an environment in the original's layout: ``[DATE TIME] [ENV] [LEVEL] TEXT``."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Final, TextIO

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.errors import TraceError
from cxbridge.events import Level
from cxbridge.executive.host.loggers import ClipsLogger

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

_LEVEL: Final = "info"  # the original writes this level into each line of a file


class EnvironmentLog:
    """Writes the lines of an environment into a file.

    :param clock: the clock for time stamps; a virtual clock gives UTC.
    :raises TraceError: if the file is not writable.
    """

    def __init__(self, folder: Path, name: str, clock: Clock) -> None:
        self._name, self._clock = name, clock
        self._second, self._stamp = -1, ""
        file = folder / f"{name}.log"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file: TextIO = file.open("w", encoding="utf-8", errors="surrogateescape", buffering=1 << 16)
        except OSError as error:
            raise TraceError(f"cannot write the log: {error.strerror}", file=file) from error

    def write(self, _level: Level, line: str) -> None:
        # the formatted stamp is kept for a second: formatting each line is slow
        second, microseconds = divmod(self._clock.now_us(), MICROSECONDS)
        if second != self._second:
            calendar = time.gmtime(second) if self._clock.is_virtual else time.localtime(second)
            self._second, self._stamp = second, time.strftime("%Y-%m-%d %H:%M:%S", calendar)
        self._file.write(f"[{self._stamp}.{microseconds // 1000:03}] [{self._name}] [{_LEVEL}] {line}\n")

    def flush(self) -> None:
        self._file.flush()

    def close(self) -> None:
        self._file.close()


class EnvironmentLogs:
    """The log files of a node's environments.

    :param folder: the folder for the files; None for no files.
    """

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder
        self._logs: list[EnvironmentLog] = []

    def begin(self, env: ClipsEnvironment) -> None:
        """Open the log file of an environment, and write the environment's output into the file.

        :raises TraceError: if the file is not writable.
        """
        if self._folder is None:
            return
        log = EnvironmentLog(self._folder, env.name, env.bus.clock)
        self._logs.append(log)
        env.loggers.add(ClipsLogger("file", log.write, component=env.name))

    def close(self) -> None:
        while self._logs:
            self._logs.pop().close()
