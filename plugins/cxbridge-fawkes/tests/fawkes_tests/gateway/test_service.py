"""The gateway as a separate process; test_gateway and test_remote_skiller test the mirrored data."""

from __future__ import annotations

import signal

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.interfaces import InterfaceRegistry, SkillerInterface
from tests.programs import Started

WAIT_S = 20


def test_signals_stop_it_and_the_mirrored_writer_goes(tmp_path):
    with (
        LocalBlackBoard(InterfaceRegistry(), RealClock()) as left,
        LocalBlackBoard(InterfaceRegistry(), RealClock()) as right,
        ZmqBlackBoardServer(left, [f"ipc://{tmp_path}/left"]) as one,
        ZmqBlackBoardServer(right, [f"ipc://{tmp_path}/right"]) as two,
    ):
        left.open_for_writing(SkillerInterface, "Skiller", owner="skiller")
        reader = right.open_for_reading(SkillerInterface, "Skiller", owner="test")
        command = ["gateway", one.endpoints[0], two.endpoints[0], "-i", "SkillerInterface"]
        process = Started(*command)
        for line in process.stderr:
            if "SkillerInterface::Skiller:" in line:
                break
        assert reader.has_writer
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=WAIT_S)
        assert process.returncode == 0, errors
        assert not reader.has_writer
