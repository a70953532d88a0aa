"""Lines of text files of any size and any content, in bounded memory."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from cxbridge.errors import TraceError

MAX_LINE = 4 * 1024 * 1024
"""Longest line, and longest entry of several lines, in bytes: far above any fact, far below any memory."""


def read_lines(path: Path) -> Iterator[tuple[int, str, bool]]:
    r"""Yield ``(number, text, whole)`` for each line; ``whole`` is False for a last line without its end.

    Only line feeds end lines. Bytes that are no UTF-8 appear as ``\xNN``.

    :raises TraceError: when the file cannot be read, or a line is longer than :data:`MAX_LINE`.
    """
    number = 0
    try:
        with path.open("rb") as file:
            while line := file.readline(MAX_LINE + 1):
                number += 1
                if len(line) > MAX_LINE:
                    raise TraceError(
                        f"a line of more than {MAX_LINE >> 20} MiB",
                        file=path,
                        line=number,
                        hint="this is no text log of a run, or it is damaged here",
                    )
                whole = line.endswith(b"\n")
                yield number, (line[:-1] if whole else line).decode("utf-8", "backslashreplace"), whole
    except OSError as error:
        raise TraceError(f"cannot be read: {error.strerror}", file=path) from error
