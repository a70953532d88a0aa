"""The file with the rows of a sweep, from which an interrupted sweep resumes."""

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


class RowFile(Closing):
    """A file of rows, each a line of JSON. New rows are appended.

    :param file: the path; a missing file is created.
    :raises CxbridgeError: if a complete line is not a row, or the file cannot be read or written.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        self._rows: dict[str, dict[int, RunRow]] = {}
        try:
            complete_bytes = self._read_rows(file.read_bytes()) if file.exists() else 0
            self._output: IO[bytes] = file.open("ab")
            self._output.truncate(complete_bytes)  # removes an incomplete last line
        except OSError as error:
            raise CxbridgeError(f"cannot be used: {error.strerror}", file=file) from error

    def _read_rows(self, file_bytes: bytes) -> int:
        """Read the existing rows and return the number of bytes in complete lines.

        :raises CxbridgeError: if a complete line is not a row.
        """
        complete_bytes = 0
        for number, line in enumerate(file_bytes.splitlines(keepends=True), 1):
            if not line.endswith(b"\n"):
                break  # the writer was killed in the middle of the line
            try:
                decoded_line = _DECODER.decode(line)
            except msgspec.MsgspecError as error:
                raise CxbridgeError(
                    f"is not a row of a sweep: {error}", file=self._file, line=number
                ) from None
            self._rows.setdefault(decoded_line.agent, {})[decoded_line.row.seed] = decoded_line.row
            complete_bytes += len(line)
        return complete_bytes

    def find_earlier_rows(self, agent: str) -> dict[int, RunRow]:
        """Return the rows of an agent from earlier sweeps, by seed."""
        return self._rows.get(agent, {})

    def add(self, agent: str, row: RunRow) -> None:
        """Append a row.

        :raises CxbridgeError: if the file cannot be written.
        """
        try:
            self._output.write(msgspec.json.encode(_Line(agent, row)) + b"\n")
            self._output.flush()  # a killed sweep loses no row
        except OSError as error:
            raise CxbridgeError(f"cannot be written: {error.strerror}", file=self._file) from error

    def close(self) -> None:
        with suppress(OSError):  # add() has reported a full disk already
            self._output.close()
