"""Limits the memory of rosbags, whose own functions unpack chunks and messages of any size."""

from __future__ import annotations

import functools
import io
from collections.abc import Callable
from typing import Any, Final

import lz4.frame
import rosbags.rosbag2.reader as of_bags
import rosbags.rosbag2.storage_mcap as of_chunks
from rosbags.rosbag2 import ReaderError

from cxbridge.trace.formats.mcap.records import MAX_RECORD

MOST_BYTES: Final = MAX_RECORD  # limit of an unpacked chunk or message, in bytes

MOST_TIMES: Final = 100  # largest expansion factor of a whole packed file beyond `MOST_BYTES`

_PIECE: Final = 1024 * 1024  # bytes per read, so that the limit is checked before memory is used up


def _decompress(make: Callable[[], Any], data: bytes) -> bytes:
    """Unpack data frame by frame."""
    parts: list[bytes] = []
    remaining_bytes = MOST_BYTES
    while data:
        frame = make()
        part = bytes(frame.decompress(data, remaining_bytes + 1))
        remaining_bytes -= len(part)
        if remaining_bytes < 0 or (not frame.eof and not part):
            raise ReaderError(
                f"a chunk or message of more than {MOST_BYTES} bytes"
                if remaining_bytes < 0
                else "a cut chunk or message"
            )
        parts.append(part)
        data = frame.unused_data or b"" if frame.eof else b""
    return b"".join(parts)


class _Zstd:
    """Replacement for the zstd module in rosbags."""

    def __init__(self, module: Any) -> None:
        self._module = module

    def __getattr__(self, name: str) -> Any:
        return getattr(self._module, name)

    def decompress(self, data: bytes) -> bytes:
        return _decompress(self._module.ZstdDecompressor, data)

    def open(self, file: Any, mode: str) -> Any:
        """Open a packed file after checking its unpacked size.

        :raises ReaderError: if the size exceeds the limits.
        """
        packed = file.seek(0, io.SEEK_END)
        most = max(MOST_BYTES, MOST_TIMES * packed)
        file.seek(0)
        with self._module.open(file, mode) as unpacked:
            size = 0
            while piece := unpacked.read(_PIECE):
                size += len(piece)
                if size > most:
                    raise ReaderError(f"a packed file of {packed} bytes becomes more than {most}")
        file.seek(0)
        return self._module.open(file, mode)


@functools.cache
def bound_unpacking() -> None:
    """Install the limits in rosbags, for this process."""
    modules: tuple[Any, Any] = (of_bags, of_chunks)
    for module in modules:
        module.zstd = _Zstd(module.zstd)
    modules[1].lz4_decompress = functools.partial(_decompress, lz4.frame.LZ4FrameDecompressor)
