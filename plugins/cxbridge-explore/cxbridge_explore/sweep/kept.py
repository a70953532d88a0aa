"""Keeps the rows of a sweep in a file as they come, so that one that was broken off goes on where it was."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import IO

import msgspec

from cxbridge.closing import Closing
from cxbridge.errors import CxbridgeError
from cxbridge_explore.sweep.rows import RunRow


class _Line(msgspec.Struct, frozen=True):
    """A line of the file."""

    agent: str
    row: RunRow


_DECODER = msgspec.json.Decoder(_Line)


class KeptRows(Closing):
    """A file of rows, a line of JSON each. What is there stays; what comes is added.

    :param file: made when it is not there.
    :raises CxbridgeError: when it cannot be read or written, or holds something else.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        self._rows: dict[str, dict[int, RunRow]] = {}
        try:
            whole = self._read(file.read_bytes()) if file.exists() else 0
            self._output: IO[bytes] = file.open("ab")
            self._output.truncate(whole)
        except OSError as error:
            raise CxbridgeError(f"cannot be used: {error.strerror}", file=file) from error

    def _read(self, data: bytes) -> int:
        """Take the rows that are there; return how many bytes are whole lines."""
        whole = 0
        for number, line in enumerate(data.splitlines(keepends=True), 1):
            if not line.endswith(b"\n"):
                break  # somebody was killed in the middle of it
            try:
                found = _DECODER.decode(line)
            except msgspec.MsgspecError as error:
                raise CxbridgeError(
                    f"is not a row of a sweep: {error}", file=self._file, line=number
                ) from None
            self._rows.setdefault(found.agent, {})[found.row.seed] = found.row
            whole += len(line)
        return whole

    def of(self, agent: str) -> dict[int, RunRow]:
        """Return the rows of an agent, by seed."""
        return self._rows.get(agent, {})

    def add(self, agent: str, row: RunRow) -> None:
        """Keep a row.

        :raises CxbridgeError: when it cannot be written.
        """
        try:
            self._output.write(msgspec.json.encode(_Line(agent, row)) + b"\n")
            self._output.flush()
        except OSError as error:
            raise CxbridgeError(f"cannot be written: {error.strerror}", file=self._file) from error

    def close(self) -> None:
        """Close the file."""
        with suppress(OSError):  # a full disk was said before
            self._output.close()
