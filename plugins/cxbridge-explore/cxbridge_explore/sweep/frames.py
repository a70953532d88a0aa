"""Frames on a pipe: four bytes of length, then the data. It travels, so it imports nothing of ours."""

from __future__ import annotations

import struct
from typing import IO, Final

_LENGTH: Final = struct.Struct(">I")


def write_frame(pipe: IO[bytes], data: bytes) -> None:
    """Write a frame.

    :raises OSError: when the reader is gone.
    """
    pipe.write(_LENGTH.pack(len(data)) + data)
    pipe.flush()


def read_frame(pipe: IO[bytes]) -> bytes | None:
    """Return the next frame; None when there is no whole one any more."""
    head = pipe.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        return None
    (length,) = _LENGTH.unpack(head)
    data = pipe.read(length)
    return data if len(data) == length else None
