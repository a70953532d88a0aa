"""Blackboards by URL."""

from __future__ import annotations

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.urls import BadUrlError, open_blackboard
from cxbridge.blackboard.zmq import ZmqBlackBoard
from cxbridge.clock import VirtualClock
from tests.blackboard.samples import SampleRegistry
from tests.blackboard.zmq.support import bench


def test_local_is_a_new_board():
    assert isinstance(open_blackboard("local:", SampleRegistry(), VirtualClock()), LocalBlackBoard)


@pytest.mark.parametrize("transport", ["ipc", "tcp"])
def test_zeromq_by_its_endpoint(transport, tmp_path):
    with bench(transport, tmp_path) as made:
        with open_blackboard(made.url, SampleRegistry(), VirtualClock(), name="by url") as board:
            assert isinstance(board, ZmqBlackBoard)
            assert board.open_for_reading("SampleInterface", "a").valid
        assert not board.connected


@pytest.mark.parametrize("url", ["", "local", "http://x", "127.0.0.1:1910", "local:x"])
def test_other_urls_are_refused(url):
    with pytest.raises(BadUrlError):
        open_blackboard(url, SampleRegistry(), VirtualClock())
