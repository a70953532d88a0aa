"""The gateway as a separate process; `test_gateway` and `test_remote_skiller` test the mirrored data."""

from __future__ import annotations

import signal

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.interfaces import InterfaceRegistry, SkillerInterface
from tests.programs import Started

WAIT_S = 20


def test_sigterm_stops_gateway_and_removes_mirrored_writer(tmp_path):
    with (
        LocalBlackBoard(InterfaceRegistry(), RealClock()) as left,
        LocalBlackBoard(InterfaceRegistry(), RealClock()) as right,
        ZmqBlackBoardServer(left, [f"ipc://{tmp_path}/left"]) as left_server,
        ZmqBlackBoardServer(right, [f"ipc://{tmp_path}/right"]) as right_server,
    ):
        left.open_for_writing(SkillerInterface, "Skiller", owner="skiller")
        reader = right.open_for_reading(SkillerInterface, "Skiller", owner="test")
        command = ["gateway", left_server.endpoints[0], right_server.endpoints[0], "-i", "SkillerInterface"]
        process = Started(*command)
        for line in process.stderr:
            if "SkillerInterface::Skiller:" in line:
                break
        assert reader.has_writer
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=WAIT_S)
        assert process.returncode == 0, errors
        assert not reader.has_writer
