"""Keys of endpoints that other machines can reach."""

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
REMOTE = [
    "tcp://*:1",
    "tcp://0.0.0.0:1",
    "tcp://192.168.1.2:1",
    "tcp://[::]:1",
    "tcp://robot:1",
    "tcp://eth0:*",
    "ipc://@x",
]


@pytest.mark.parametrize("endpoint", LOCAL)
def test_local_endpoints_need_no_keys(endpoint):
    check_endpoint(endpoint, has_keys=False, is_insecure_allowed=False)


@pytest.mark.parametrize("endpoint", REMOTE)
def test_remote_endpoints_need_keys_or_insecure(endpoint):
    with pytest.raises(InsecureEndpointError, match="needs CURVE keys"):
        check_endpoint(endpoint, has_keys=False, is_insecure_allowed=False)
    check_endpoint(endpoint, has_keys=True, is_insecure_allowed=False)
    check_endpoint(endpoint, has_keys=False, is_insecure_allowed=True)


@pytest.mark.parametrize("endpoint", ["", "tcp", "tcp://", "udp://127.0.0.1:1", "127.0.0.1:1"])
def test_invalid_endpoint_is_refused(endpoint):
    with pytest.raises(EndpointError, match="is not an endpoint"):
        check_endpoint(endpoint, has_keys=False, is_insecure_allowed=False)


NAMES = ("friend", "stranger")


@pytest.fixture
def keys(tmp_path: Path) -> Path:
    for name in ("server", "friend", "stranger"):
        zmq.auth.create_certificates(tmp_path, name)
    (tmp_path / "clients").mkdir()
    (tmp_path / "friend.key").rename(tmp_path / "clients" / "friend.key")
    return tmp_path


def test_server_accepts_only_known_keys(keys):
    server_keys = CurveServer(keys / "server.key_secret", keys / "clients")
    with bench("tcp", keys, keys=server_keys) as served:
        friend = keys / "friend.key_secret"
        assert list(served.client(keys=CurveClient(friend, keys / "server.key")).list_all()) == []
        for wrong in (
            CurveClient(keys / "stranger.key_secret", keys / "server.key"),
            CurveClient(friend, keys / "stranger.key"),  # the key of another server
            None,
        ):
            with pytest.raises(DisconnectedError, match="no blackboard replies"):
                served.client(keys=wrong, connect_timeout=0.7)
        assert served.server.session_count == 1


def test_handshake_refused_before_hello_times_out(monkeypatch):
    """libzmq removes the connection then, so that a blocking send would never return."""

    def make_unconnected_socket(context, _url, _route, _keys):
        return context.socket(zmq.DEALER)

    monkeypatch.setattr(session, "connect", make_unconnected_socket)
    with pytest.raises(DisconnectedError, match="no blackboard replies"):
        ZmqBlackBoard("tcp://127.0.0.1:1", SampleRegistry(), VirtualClock(), connect_timeout=0.3)


@pytest.mark.parametrize("file", ["none.key", "server.key"])
def test_invalid_key_file_is_error_with_path(keys, file):
    board = LocalBlackBoard(SampleRegistry(), VirtualClock())
    server = ZmqBlackBoardServer(
        board, ["tcp://127.0.0.1:*"], keys=CurveServer(keys / file, keys / "clients")
    )
    with pytest.raises(EndpointError) as caught:
        server.start()
    assert caught.value.file == str(keys / file)


@pytest.mark.skipif(sys.platform != "linux", reason="abstract sockets are of Linux")
def test_abstract_socket_needs_keys(keys):
    url = f"ipc://@cxbridge-test-{os.getpid()}"
    board = LocalBlackBoard(SampleRegistry(), VirtualClock())
    with pytest.raises(InsecureEndpointError):
        ZmqBlackBoardServer(board, [url])
    friend, stranger = (f"key={keys}/{name}.key_secret&server-key={keys}/server.key" for name in NAMES)
    with ZmqBlackBoardServer(board, [url], keys=CurveServer(keys / "server.key_secret", keys / "clients")):

        def list_all(query: str, timeout: float) -> list[object]:
            full_url = f"{url}?{query}"
            with open_blackboard(full_url, SampleRegistry(), RealClock(), connect_timeout=timeout) as client:
                return list(client.list_all())

        assert list_all(friend, LONG) == []
        for query in (stranger, "insecure=yes"):
            with pytest.raises(DisconnectedError):
                list_all(query, 0.7)


def test_only_user_may_access_ipc_endpoint(tmp_path):
    with bench("ipc", tmp_path):
        assert (tmp_path / "board").stat().st_mode & 0o777 == 0o600
