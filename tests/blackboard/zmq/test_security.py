"""Endpoints beyond this machine need keys; without the right key nobody gets in."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
import zmq.auth

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.kit.errors import DisconnectedError, EndpointError, InsecureEndpointError
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.blackboard.zmq import CurveClient, CurveServer, ZmqBlackBoard, ZmqBlackBoardServer
from cxbridge.blackboard.zmq.client import session
from cxbridge.blackboard.zmq.security import check_endpoint
from cxbridge.clock import RealClock, VirtualClock
from tests.blackboard.samples import SampleRegistry
from tests.blackboard.zmq.support import LONG, bench

LOCAL = [
    "tcp://127.0.0.1:1",
    "tcp://127.9.9.9:*",
    "tcp://localhost:1",
    "tcp://[::1]:1",
    "ipc:///x",
]
BEYOND = [
    "tcp://*:1",
    "tcp://0.0.0.0:1",
    "tcp://192.168.1.2:1",
    "tcp://[::]:1",
    "tcp://robot:1",
    "tcp://eth0:*",
    "ipc://@x",
]


@pytest.mark.parametrize("endpoint", LOCAL)
def test_endpoints_of_this_machine_are_free(endpoint):
    check_endpoint(endpoint, keys=False, insecure=False)


@pytest.mark.parametrize("endpoint", BEYOND)
def test_endpoints_beyond_need_keys_or_a_word(endpoint):
    with pytest.raises(InsecureEndpointError, match="needs CURVE keys"):
        check_endpoint(endpoint, keys=False, insecure=False)
    check_endpoint(endpoint, keys=True, insecure=False)
    check_endpoint(endpoint, keys=False, insecure=True)


@pytest.mark.parametrize("endpoint", ["", "tcp", "tcp://", "udp://127.0.0.1:1", "127.0.0.1:1"])
def test_what_is_no_endpoint(endpoint):
    with pytest.raises(EndpointError, match="is not an endpoint"):
        check_endpoint(endpoint, keys=False, insecure=False)


NAMES = ("friend", "stranger")


@pytest.fixture
def keys(tmp_path: Path) -> Path:
    for name in ("server", "friend", "stranger"):
        zmq.auth.create_certificates(tmp_path, name)
    (tmp_path / "clients").mkdir()
    (tmp_path / "friend.key").rename(tmp_path / "clients" / "friend.key")
    return tmp_path


def test_only_known_keys_get_in(keys):
    server_keys = CurveServer(keys / "server.key_secret", keys / "clients")
    with bench("tcp", keys, keys=server_keys) as made:
        friend = keys / "friend.key_secret"
        assert list(made.client(keys=CurveClient(friend, keys / "server.key")).list_all()) == []
        for wrong in (
            CurveClient(keys / "stranger.key_secret", keys / "server.key"),
            CurveClient(friend, keys / "stranger.key"),  # that of another server
            None,
        ):
            with pytest.raises(DisconnectedError, match="no blackboard replies"):
                made.client(keys=wrong, connect_timeout=0.7)
        assert made.server.session_count == 1


def test_a_handshake_that_is_refused_before_hello_hangs_nobody(monkeypatch):
    """libzmq then takes the way to the server away, and a send would wait for another one for ever."""

    def connect_to_nobody(context, _url, _route, _keys):
        return context.socket(zmq.DEALER)

    monkeypatch.setattr(session, "connect", connect_to_nobody)
    with pytest.raises(DisconnectedError, match="no blackboard replies"):
        ZmqBlackBoard("tcp://127.0.0.1:1", SampleRegistry(), VirtualClock(), connect_timeout=0.3)


@pytest.mark.parametrize("file", ["none.key", "server.key"])
def test_a_key_file_that_is_none(keys, file):
    board = LocalBlackBoard(SampleRegistry(), VirtualClock())
    server = ZmqBlackBoardServer(
        board, ["tcp://127.0.0.1:*"], keys=CurveServer(keys / file, keys / "clients")
    )
    with pytest.raises(EndpointError) as caught:
        server.start()
    assert caught.value.file == str(keys / file)


@pytest.mark.skipif(sys.platform != "linux", reason="abstract sockets are of Linux")
def test_an_abstract_socket_has_no_owner_and_takes_keys(keys):
    url = f"ipc://@cxbridge-test-{os.getpid()}"
    board = LocalBlackBoard(SampleRegistry(), VirtualClock())
    with pytest.raises(InsecureEndpointError):
        ZmqBlackBoardServer(board, [url])
    friend, stranger = (f"key={keys}/{name}.key_secret&server-key={keys}/server.key" for name in NAMES)
    with ZmqBlackBoardServer(board, [url], keys=CurveServer(keys / "server.key_secret", keys / "clients")):

        def list_all(query: str, patience: float) -> list[object]:
            place = f"{url}?{query}"
            with open_blackboard(place, SampleRegistry(), RealClock(), connect_timeout=patience) as client:
                return list(client.list_all())

        assert list_all(friend, LONG) == []
        for query in (stranger, "insecure=yes"):
            with pytest.raises(DisconnectedError):
                list_all(query, 0.7)


def test_an_ipc_endpoint_is_for_its_user_only(tmp_path):
    with bench("ipc", tmp_path):
        assert (tmp_path / "board").stat().st_mode & 0o777 == 0o600
