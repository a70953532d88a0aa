"""Blackboards by URL, with keys in the query."""

from __future__ import annotations

import pytest
import zmq.auth

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.blackboard.zmq.security import CurveServer
from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.errors import BlackBoardError
from cxbridge.interfaces import InterfaceRegistry, SkillerInterface


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("nonsense", "is not a blackboard's URL"),
        ("http://robot", "is not a blackboard's URL"),
        ("ipc:///tmp/x?insecure=yes", "does not support the query '?insecure=yes'"),
        ("tcp://127.0.0.1:1?key=a", "must have both keys"),
        ("tcp://127.0.0.1:1?key=a&server-key=b&more=c", "must have both keys"),
        ("tcp://192.0.2.1:1911", "could be reached from beyond this machine"),
    ],
)
def test_invalid_urls_are_refused_with_hint(url, message):
    with pytest.raises(BlackBoardError) as caught:
        open_blackboard(url, InterfaceRegistry(), RealClock())
    assert message in caught.value.message
    assert caught.value.hint


def test_keys_in_query_connect_to_server_with_keys(tmp_path):
    (tmp_path / "clients").mkdir()
    server_key, server_secret = zmq.auth.create_certificates(tmp_path, "server")
    _, client_secret = zmq.auth.create_certificates(tmp_path / "clients", "client")
    with LocalBlackBoard(InterfaceRegistry(), RealClock()) as local:
        local.open_for_writing(SkillerInterface, "Skiller", owner="skiller")
        keys = CurveServer(tmp_path / server_secret, tmp_path / "clients")
        with ZmqBlackBoardServer(local, ["tcp://127.0.0.1:*"], keys=keys) as server:
            url = f"{server.endpoints[0]}?key={client_secret}&server-key={server_key}"
            with open_blackboard(url, InterfaceRegistry(), RealClock()) as board:
                assert [info.uid for info in board.list()] == ["SkillerInterface::Skiller"]
