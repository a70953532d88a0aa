"""Blocks with invalid time stamps."""

from __future__ import annotations

import struct

import pytest

from tests.blackboard.zmq.support import bench

STAMPS = [(2**63 - 1, 2**63 - 1), (2**50, 0), (-1, -1), (-(2**63), -(2**63))]


@pytest.mark.parametrize("stamp", STAMPS)
def test_list_has_interface_with_invalid_time_stamp(stamp, tmp_path):
    with bench("ipc", tmp_path) as served:
        writing_client, listing_client = served.client(), served.client()
        writer = writing_client.open_for_writing("SampleInterface", "x")
        size = len(writer.to_bytes())
        writer.set_from_chunk(struct.pack("=qq", *stamp) + bytes(size - 16))
        writer._port.publish(writer, writer._buf, True, True)
        writing_client.flush()
        assert [info.id for info in listing_client.list_all()] == ["x"]
        assert listing_client.connected
