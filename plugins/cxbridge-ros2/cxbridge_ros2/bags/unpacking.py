"""Limits the memory of rosbags, whose own functions unpack chunks and messages of any size.

A small file may expand to more than the memory. rosbags has no hook for a limit, so functions in its modules
are replaced.
"""

from __future__ import annotations

import functools
import io
from collections.abc import Callable
from typing import Any, Final

import lz4.frame
import rosbags.rosbag2.reader as bag_module
import rosbags.rosbag2.storage_mcap as mcap_module
from rosbags.rosbag2 import ReaderError

from cxbridge.trace.formats.mcap.records import MAX_RECORD

MAX_BYTES: Final = MAX_RECORD  # limit of an unpacked chunk or message, in bytes

MAX_EXPANSION: Final = 100  # largest expansion factor of a whole packed file beyond `MAX_BYTES`

_READ_BYTES: Final = 1024 * 1024  # bytes per read, so that the limit is checked before memory is used up


def _decompress(make: Callable[[], Any], data: bytes) -> bytes:
    """Unpack data frame by frame."""
    chunks: list[bytes] = []
    remaining_bytes = MAX_BYTES
    while data:
        frame = make()
        chunk = bytes(frame.decompress(data, remaining_bytes + 1))
        remaining_bytes -= len(chunk)
        if remaining_bytes < 0:
            raise ReaderError(f"a chunk or message of more than {MAX_BYTES} bytes")
        if not frame.eof and not chunk:
            raise ReaderError("a cut chunk or message")
        chunks.append(chunk)
        data = frame.unused_data or b"" if frame.eof else b""
    return b"".join(chunks)


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
        limit = max(MAX_BYTES, MAX_EXPANSION * packed)
        file.seek(0)
        with self._module.open(file, mode) as unpacked:
            size = 0
            while chunk := unpacked.read(_READ_BYTES):
                size += len(chunk)
                if size > limit:
                    raise ReaderError(f"a packed file of {packed} bytes becomes more than {limit}")
        file.seek(0)
        return self._module.open(file, mode)


@functools.cache
def limit_unpacking() -> None:
    """Install the limits in rosbags, for this process."""
    bags: Any = bag_module
    mcap: Any = mcap_module
    for module in (bags, mcap):
        module.zstd = _Zstd(module.zstd)
    mcap.lz4_decompress = functools.partial(_decompress, lz4.frame.LZ4FrameDecompressor)
