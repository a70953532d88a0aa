"""Frames on a pipe: a length of four bytes, then the data.

The module is sent to other machines, so it must not import other modules of cxbridge.
"""

from __future__ import annotations

import struct
from typing import IO, Final

_LENGTH: Final = struct.Struct(">I")


def write_frame(pipe: IO[bytes], data: bytes) -> None:
    """Write a frame.

    :raises OSError: if the reader is gone.
    """
    pipe.write(_LENGTH.pack(len(data)) + data)
    pipe.flush()


def read_frame(pipe: IO[bytes]) -> bytes | None:
    """Return the next frame, or None at the end or for an incomplete frame."""
    head = pipe.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        return None
    (length,) = _LENGTH.unpack(head)
    data = pipe.read(length)
    return data if len(data) == length else None
