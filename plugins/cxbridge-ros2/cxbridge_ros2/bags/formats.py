"""Formats of ROS 2 bags (rosbag2): folders with a metadata.yaml, and their mcap or sqlite3 files."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Final

from cxbridge.trace.formats.base import CopyFormat, Format
from cxbridge.trace.formats.mcap.records import MAGIC

METADATA: Final = "metadata.yaml"  # file whose presence makes a folder a bag

_READER: Final = "cxbridge_ros2.bags.reader:BagRun"
_SQLITE: Final = b"SQLite format 3\0"
_PROFILE: Final = b"ros2"
# Offset of the profile: after the magic bytes, and the opcode and length of the first record.
_PROFILE_OFFSET: Final = len(MAGIC) + 1 + 8


def _is_bag(path: Path, head: bytes) -> bool:
    # a folder has no first bytes
    return not head and (path / METADATA).is_file()


def _is_file_of_bag(path: Path, head: bytes) -> bool:
    if head.startswith(_SQLITE):
        return path.suffix == ".db3"
    if not head.startswith(MAGIC) or path.suffix != ".mcap":
        return False
    try:
        (size,) = struct.unpack_from("<I", head, _PROFILE_OFFSET)
    except struct.error:
        return False
    return head[_PROFILE_OFFSET + 4 : _PROFILE_OFFSET + 4 + size] == _PROFILE


FORMATS = (
    Format("rosbag", 5, recognises=_is_file_of_bag, reader=_READER),
    Format("rosbag", 6, recognises=_is_bag, reader=_READER),
)
COPIES = (
    CopyFormat("rosbag", 50, "cxbridge_ros2.bags.writer:open_mcap"),
    CopyFormat("rosbag-sqlite3", 51, "cxbridge_ros2.bags.writer:open_sqlite3"),
)
