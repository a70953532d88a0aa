"""Sessions that the fuzzer has recorded (docs/security.md)."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.blackboard.zmq.server.requests import RequestHandler
from fuzz.sessions import SCRIPTS, zmq_sessions

SESSIONS = sorted((Path(__file__).parent / "corpus_sessions").iterdir())


def test_server_survives_recorded_sessions():
    assert len(SESSIONS) > 100
    for file in SESSIONS:
        zmq_sessions(file.read_bytes())


def test_scripts_of_sessions_pass():
    for script in SCRIPTS:
        zmq_sessions(script)


def test_stale_writer_is_detected(monkeypatch):

    monkeypatch.setattr(RequestHandler, "end_session", lambda service, session: None)
    with pytest.raises(AssertionError, match="a stale writer"):
        zmq_sessions(bytes((4, 0, 64, 28, 0, 3)))  # Open of a writer, then Bye
