"""Hostile clients get an answer or lose their connection, while the server stays available."""

from __future__ import annotations

import socket
import threading
from contextlib import suppress

import pytest

from cxbridge.events import LogLine
from cxbridge_web import api
from cxbridge_web.http.connections import IdleLimitedConnection
from tests.daemon.test_daemon import WAIT_S
from web_tests.support import serving

HOST = b"Host: localhost\r\n"
CLOSING = HOST + b"Connection: close\r\n"
JSON = CLOSING + b"Content-Type: application/json\r\n"
MESSAGES = b"POST /api/cxbridge/blackboard/SwitchInterface/lamp/messages HTTP/1.1\r\n" + JSON
NO_EXECUTIVE = (("executive", False), ("skiller", "none"))


@pytest.fixture(name="served", scope="module")
def _served():
    with serving(NO_EXECUTIVE) as (daemon, client, _lines):
        yield daemon, client


def exchange(client, request):
    """Send bytes, and return the received bytes until the server ends the connection."""
    answer = b""
    with socket.create_connection(("127.0.0.1", int(client.url.rpartition(":")[2])), WAIT_S) as peer:
        with suppress(ConnectionError):  # the server may close the connection after its answer
            peer.sendall(request)
        with suppress(ConnectionError):  # the reset after unread data
            while chunk := peer.recv(65536):
                answer += chunk
    return answer


def with_body(body):
    return MESSAGES + b"Content-Length: %d\r\n\r\n" % len(body) + body


def get(path, headers=b""):
    return b"GET " + path + b" HTTP/1.1\r\n" + CLOSING + headers + b"\r\n"


@pytest.mark.parametrize(
    ("request_bytes", "status"),
    [
        # invalid lengths
        (MESSAGES + b"Content-Length: 4\r\nContent-Length: 5\r\n\r\nabcde", 400),
        (MESSAGES + b"Transfer-Encoding: gzip, chunked\r\n\r\n0\r\n\r\n", 400),
        (MESSAGES + b"Transfer-Encoding: chunked\r\n\r\nZZ\r\n", 400),
        (MESSAGES + b"Content-Length: -4\r\n\r\n", 400),
        (MESSAGES + b"Content-Length: " + b"9" * 30 + b"\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\n" + CLOSING + b"Host: evil.example\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\nHost : localhost\r\n\r\n", 400),
        (b"GET http://evil.example/api/cxbridge/status HTTP/1.1\r\n" + CLOSING + b"\r\n", 404),
        # different protocols
        (b"GET /\r\n\r\n", 400),
        (b"GET /api/cxbridge/status HTTP/1.0\r\n\r\n", 421),
        (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n", 400),
        (b"CONNECT evil.example:443 HTTP/1.1\r\n" + CLOSING + b"\r\n", 405),
        (get(b"/api/cxbridge/status", b"Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"), 200),
        # large requests
        (b"GET / HTTP/1.1\r\n" + b"".join(b"X-%d: y\r\n" % number for number in range(10_000)), 400),
        (get(b"/" + b"a" * 60_000), 404),
        (MESSAGES + b"Transfer-Encoding: chunked\r\n\r\n1;" + b"x" * 70_000, 400),
        (
            MESSAGES + b"Transfer-Encoding: chunked\r\n\r\n" + (b"10000\r\n" + b"x" * 65536 + b"\r\n") * 17,
            413,
        ),
        (with_body(b'{"type":' + b"[" * 500_000), 400),
        (with_body(b'{"type":' + b"9" * 100_000 + b"}"), 400),
        (with_body(b'{"type":"(a \\"\\ud800\\")"}'), 400),
        # paths out of the folder
        (get(b"/../../../../../etc/passwd"), 404),
        (get(b"/%2e%2e/server.py"), 404),
        (get(b"/..%2f..%2fweb%2fserver.py"), 404),
        (get(b"/..%5cserver.py"), 404),
        (get(b"//etc/passwd"), 404),
        (get(b"/%2fetc/passwd"), 404),
        # invalid text
        (get(b"/%00"), 404),
        (get(b"/%ff%fe"), 404),
        (get(b"/%ed%a0%80"), 404),
        (get(b"/\xff"), 400),
        (get(b"/api/blackboard/interfaces/%00/%ff"), 404),
    ],
    ids=lambda value: str(value)[2:50],
)
def test_hostile_request_is_answered(served, request_bytes, status):
    _, client = served
    answer = exchange(client, request_bytes)
    assert answer.partition(b"\r\n")[0].split()[1:2] == [b"%d" % status], answer[:200]
    assert client.get("/api/cxbridge/status").status == 200


@pytest.mark.parametrize("data", [b"", b"GET / HTTP/1.1\r\nHo", b"GET / HTTP/1.1\r\n" + HOST + b"\r\nGET"])
def test_client_with_incomplete_request_is_disconnected(monkeypatch, served, data):
    """The attack needs no token: 200 such clients would block each further client."""
    _, client = served
    monkeypatch.setattr(IdleLimitedConnection, "idle_limit_s", 0.05)
    answer = exchange(client, data)
    assert answer.startswith(b"HTTP/1.1 200" if b"\r\n\r\n" in data else b"")


def test_missing_body_times_out(monkeypatch, served):
    _, client = served
    monkeypatch.setattr(api, "BODY_TIMEOUT_S", 0.05)
    monkeypatch.setattr(IdleLimitedConnection, "idle_limit_s", 0.05)
    assert exchange(client, MESSAGES + b"Content-Length: 20\r\n\r\n{").startswith(b"HTTP/1.1 408")


def test_client_that_does_not_read_is_disconnected(monkeypatch, served):
    """The server must not keep the unread answer for ever."""
    _, client = served
    lost = threading.Event()

    class WatchedConnection(IdleLimitedConnection):
        idle_limit_s = 0.05

        def connection_lost(self, exc):
            super().connection_lost(exc)
            lost.set()

    # only the new connection has this class, because existing connections may also end
    monkeypatch.setattr("cxbridge_web.http.serving.IdleLimitedConnection", WatchedConnection)
    with serving(NO_EXECUTIVE) as (_, second, _lines), socket.socket() as peer:
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        peer.settimeout(WAIT_S)
        peer.connect(("127.0.0.1", int(second.url.rpartition(":")[2])))
        peer.sendall((b"GET /api/openapi.json HTTP/1.1\r\n" + HOST + b"\r\n") * 600)
        assert lost.wait(WAIT_S)
        assert second.get("/api/cxbridge/status").status == 200
    assert client.get("/api/cxbridge/status").status == 200


def test_many_bad_requests_are_logged_few_times(served):
    daemon, client = served
    texts: list[str] = []
    daemon.bus.subscribe(lambda line: texts.append(line.text), LogLine)
    for _ in range(120):
        assert exchange(client, b"x\r\n\r\n").startswith(b"HTTP/1.1 400")
    assert len([text for text in texts if "Invalid HTTP request" in text]) <= 3


@pytest.mark.parametrize(
    ("path", "mode", "site", "status"),
    [
        ("/api/skiller/skills", "no-cors", "cross-site", 403),  # an image of a foreign page
        ("/api/skiller/skills", "navigate", "cross-site", 403),  # a window of a foreign page
        ("/", "no-cors", "same-site", 403),
        ("/", "navigate", "cross-site", 200),  # a link to the page
        ("/api/cxbridge/status", "cors", "same-origin", 200),
        ("/api/cxbridge/status", "navigate", "none", 200),  # a typed address
    ],
)
def test_foreign_site_may_only_link_to_page(served, path, mode, site, status):
    """Browsers send no Origin with images and links, so a foreign GET would reach the Skiller."""
    _, client = served
    answer = client.get(path, Sec_Fetch_Mode=mode, Sec_Fetch_Site=site)
    assert answer.status == status
    assert answer.headers["Cross-Origin-Resource-Policy"] == "same-origin"
