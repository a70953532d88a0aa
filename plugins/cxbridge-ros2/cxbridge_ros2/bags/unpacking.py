"""Limits the memory that rosbags uses to unpack chunks and messages.

A small file may expand to more than the memory. Since rosbags has no option for a limit, this module replaces
functions in the modules of rosbags.
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

from cxbridge.trace.formats.mcap.records import MAX_RECORD_SIZE

MAX_UNPACKED_BYTES: Final = MAX_RECORD_SIZE  # limit of an unpacked chunk or message, in bytes

# Limit of the expansion of a packed file, chosen freely. Every file may expand to at least
# `MAX_UNPACKED_BYTES`.
MAX_EXPANSION_FACTOR: Final = 100

_READ_BYTES: Final = 1024 * 1024  # the number of bytes of a read, after which the size is checked


def _decompress(make_decompressor: Callable[[], Any], data: bytes) -> bytes:
    """Return the content of packed data, which consists of frames.

    A truncated frame gives the content before its end, so that an interrupted recording is readable up to its
    end.

    :param make_decompressor: makes the decompressor of a frame.
    :raises ReaderError: if the unpacked data exceeds the limit, or a truncated frame has no content.
    """
    chunks: list[bytes] = []
    remaining_bytes = MAX_UNPACKED_BYTES
    while data:
        decompressor = make_decompressor()
        # one byte more than the limit reveals larger data
        chunk = bytes(decompressor.decompress(data, remaining_bytes + 1))
        remaining_bytes -= len(chunk)
        if remaining_bytes < 0:
            raise ReaderError(f"a chunk or message of more than {MAX_UNPACKED_BYTES} bytes")
        if not decompressor.eof and not chunk:
            raise ReaderError("a truncated chunk or message")
        chunks.append(chunk)
        # the next frame begins after the end of this frame; without an end, the frame has used all bytes
        data = decompressor.unused_data or b"" if decompressor.eof else b""
    return b"".join(chunks)


class _LimitedZstd:
    """Replaces the zstd module that rosbags has imported, and limits the unpacked size."""

    def __init__(self, module: Any) -> None:
        self._module = module

    def __getattr__(self, name: str) -> Any:
        return getattr(self._module, name)

    def decompress(self, data: bytes) -> bytes:
        return _decompress(self._module.ZstdDecompressor, data)

    def open(self, file: Any, mode: str) -> Any:
        """Open a packed file after unpacking it once to count its bytes.

        :raises ReaderError: if the size exceeds the limits.
        """
        packed_bytes = file.seek(0, io.SEEK_END)
        max_bytes = max(MAX_UNPACKED_BYTES, MAX_EXPANSION_FACTOR * packed_bytes)
        file.seek(0)
        with self._module.open(file, mode) as unpacked_file:
            unpacked_bytes = 0
            while chunk := unpacked_file.read(_READ_BYTES):
                unpacked_bytes += len(chunk)
                if unpacked_bytes > max_bytes:
                    raise ReaderError(
                        f"a packed file of {packed_bytes} bytes expands to more than {max_bytes}"
                    )
        file.seek(0)
        return self._module.open(file, mode)


@functools.cache
def limit_unpacking() -> None:
    """Replace the functions in rosbags for the rest of this process. Further calls do nothing."""
    # typed as Any, since the type checker forbids replacing the members of a module
    any_bag_module: Any = bag_module
    any_mcap_module: Any = mcap_module
    for module in (any_bag_module, any_mcap_module):
        module.zstd = _LimitedZstd(module.zstd)
    any_mcap_module.lz4_decompress = functools.partial(_decompress, lz4.frame.LZ4FrameDecompressor)
