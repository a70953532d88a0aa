"""Reading and decoding of PDDL files."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from cxbridge.errors import PddlError
from cxbridge.suggestions import did_you_mean

MAX_FILE_BYTES: Final = 64 << 20
"""The maximum size of a file. The largest known public file has 4 MB."""


def read_text(path: str | Path, kind: str) -> str:
    """Return the text of a file.

    :param kind: the expected content, for error messages.
    :raises PddlError: if the file cannot be read or is too large.
    """
    try:
        with Path(path).open("rb") as file:
            content = file.read(MAX_FILE_BYTES + 1)  # one byte more shows that the file is too large
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise PddlError(
            f"cannot read the {kind}: {reason}",
            file=path,
            hint=did_you_mean(Path(path).name, (file.name for file in Path(path).parent.glob("*.pddl"))),
        ) from None
    return decode_text(content, path)


def decode_text(content: bytes, path: str | Path) -> str:
    """Decode the content of a file as UTF-8, with or without a byte order mark.

    Other bytes become U+FFFD, which the grammar permits in comments only.

    :raises PddlError: if the file is too large.
    """
    if len(content) > MAX_FILE_BYTES:
        raise PddlError(f"the file has more than {MAX_FILE_BYTES >> 20} MB", file=path)
    return content.decode("utf-8-sig", "replace")
