"""A writer may stamp its block with any numbers; that is no trouble for anybody else."""

from __future__ import annotations

import struct

import pytest

from tests.blackboard.zmq.support import bench

STAMPS = [(2**63 - 1, 2**63 - 1), (2**50, 0), (-1, -1), (-(2**63), -(2**63))]


@pytest.mark.parametrize("stamp", STAMPS)
def test_others_can_list_what_is_stamped_with_nonsense(stamp, tmp_path):
    with bench("ipc", tmp_path) as made:
        writing, listing = made.client(), made.client()
        writer = writing.open_for_writing("SampleInterface", "x")
        size = len(writer.to_bytes())
        writer.set_from_chunk(struct.pack("=qq", *stamp) + bytes(size - 16))
        writer._port.publish(writer, writer._buf, True, True)
        writing.flush()
        assert [info.id for info in listing.list_all()] == ["x"]
        assert listing.connected
