"""What small data become when they are unpacked is bounded, wherever the package unpacks."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("rosbags", reason="the extra ros2 is not installed")

from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from websockets.sync.server import ServerConnection, serve

from cxbridge.errors import CxbridgeError
from cxbridge.trace.formats.registry import open_run
from cxbridge_ros2.bags import unpacking
from cxbridge_ros2.transports.rosbridge import connection
from cxbridge_ros2.transports.rosbridge.connection import RosbridgeConnection

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
def test_a_bag_does_not_unpack_beyond_the_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mode: CompressionMode, storage: StoragePlugin
):
    """A chunk of 84 kB became 2 GB."""
    monkeypatch.setattr(unpacking, "MAX_UNPACKED_BYTES", MEBIBYTE)
    data = b"\0\1\0\0" + (8 * MEBIBYTE).to_bytes(4, "little") + bytes(8 * MEBIBYTE)
    writer = Writer(tmp_path / "bag", version=9, storage_plugin=storage)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        topic = writer.add_connection("/x", "std_msgs/msg/String", msgdef="string data", rihs01="RIHS01_0")
        writer.write(topic, 1, data)
    assert sum(file.stat().st_size for file in (tmp_path / "bag").iterdir()) < MEBIBYTE
    told = ""
    try:
        run = open_run(tmp_path / "bag")
        list(run)
        list(run.description())
        with run._open() as bag:  # type: ignore[attr-defined]
            list(run._read_messages(bag, lambda _connection: True))  # type: ignore[attr-defined]
        told = " ".join(run.notes)
    except CxbridgeError as error:
        told = str(error)
    assert f"more than {MEBIBYTE}" in told or "expands to more than" in told


@pytest.fixture
def bridge() -> Iterator[tuple[str, list[str]]]:
    """A rosbridge that sends the texts of a list to each client."""
    texts: list[str] = []

    def talk(client: ServerConnection) -> None:
        for text in texts:
            client.send(text)
        client.recv()

    with serve(talk, "127.0.0.1", 0) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"ws://127.0.0.1:{server.socket.getsockname()[1]}", texts
        server.shutdown()
        thread.join()


def test_a_message_of_a_rosbridge_that_is_too_large_ends_the_connection(
    bridge: tuple[str, list[str]], monkeypatch: pytest.MonkeyPatch
):
    """The limit is that of the unpacked message: websockets pack by deflate."""
    monkeypatch.setattr(connection, "MAX_MESSAGE_BYTES", MEBIBYTE)
    url, texts = bridge
    texts += [json.dumps({"op": "small"}), json.dumps({"op": "large", "msg": " " * (2 * MEBIBYTE)})]
    client = RosbridgeConnection(url)
    ops: list[str] = []
    while "" not in ops:
        ops += [str(op["op"]) for op in client.receive(WAIT_S)]
    client.close()
    assert ops[:2] == ["small", ""]
