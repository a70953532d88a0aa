"""The limit of unpacked data of compressed bags."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("rosbags", reason="the extra ros2 is not installed")

from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from cxbridge.errors import CxbridgeError
from cxbridge.trace.formats.registry import open_run
from cxbridge_ros2.bags import unpacking

MEBIBYTE = 1024 * 1024
WAIT_S = 30.0


@pytest.mark.parametrize(
    ("mode", "storage"),
    [
        (CompressionMode.MESSAGE, StoragePlugin.SQLITE3),
        (CompressionMode.FILE, StoragePlugin.SQLITE3),
        (CompressionMode.STORAGE, StoragePlugin.MCAP),
    ],
)
def test_bag_is_not_unpacked_beyond_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mode: CompressionMode, storage: StoragePlugin
):
    """Without a limit, a chunk of 84 kB became 2 GB."""
    monkeypatch.setattr(unpacking, "MAX_UNPACKED_BYTES", MEBIBYTE)
    data = b"\0\1\0\0" + (8 * MEBIBYTE).to_bytes(4, "little") + bytes(8 * MEBIBYTE)
    writer = Writer(tmp_path / "bag", version=9, storage_plugin=storage)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        kind = "std_msgs/msg/String"
        topic = writer.add_connection("/cxbridge/events", kind, msgdef="string data", rihs01="RIHS01_0")
        writer.write(topic, 1, data)
    assert sum(file.stat().st_size for file in (tmp_path / "bag").iterdir()) < MEBIBYTE
    try:
        run = open_run(tmp_path / "bag")
        list(run)
        messages = " ".join(run.notes)
    except CxbridgeError as error:
        messages = str(error)
    assert f"more than {MEBIBYTE}" in messages or "expands to more than" in messages
