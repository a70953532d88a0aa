"""Recognises ROS 2 bags (rosbag2), and names their reader and writers.

A bag is a folder with a metadata.yaml and mcap or sqlite3 files. A single file is read as a bag, too.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from cxbridge.trace.formats.base import CopyFormat, Format
from cxbridge.trace.formats.mcap.records import MAGIC

METADATA_FILE: Final = "metadata.yaml"  # file whose presence makes a folder a bag

_READER: Final = "cxbridge_ros2.bags.reader:BagRun"
_SQLITE_MAGIC: Final = b"SQLite format 3\0"
# The profile in the header of an mcap file that rosbag2 has written: a text after its length.
_ROS2_PROFILE: Final = b"\4\0\0\0ros2"
# Offset of the profile: after the magic bytes, and the opcode and length of the first record.
_PROFILE_OFFSET: Final = len(MAGIC) + 1 + 8


def _is_bag_folder(path: Path, head: bytes) -> bool:
    # `head` has the first bytes of a file, and is empty for a folder
    return not head and (path / METADATA_FILE).is_file()


def _is_bag_file(path: Path, head: bytes) -> bool:
    if head.startswith(_SQLITE_MAGIC):
        return path.suffix == ".db3"
    if not head.startswith(MAGIC) or path.suffix != ".mcap":
        return False
    return head[_PROFILE_OFFSET:].startswith(_ROS2_PROFILE)


# The number gives the order of the formats' checks: the files before the folder, and both before the format
# `mcap`, which recognises any mcap file.
FORMATS = (
    Format("rosbag", 5, recognises=_is_bag_file, reader=_READER),
    Format("rosbag", 6, recognises=_is_bag_folder, reader=_READER),
)
# The numbers give the positions in lists of formats.
COPIES = (
    CopyFormat("rosbag", 50, "cxbridge_ros2.bags.writer:open_mcap"),
    CopyFormat("rosbag-sqlite3", 51, "cxbridge_ros2.bags.writer:open_sqlite3"),
)
