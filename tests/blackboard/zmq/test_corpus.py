"""What a fuzzer found worth keeping (docs/security.md), once more."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.blackboard.zmq.server.requests import RequestHandler
from fuzz.sessions import SCRIPTS, zmq_sessions

SESSIONS = sorted((Path(__file__).parent / "corpus_sessions").iterdir())


def test_whatever_clients_did_to_a_server_it_stays_sane():
    assert len(SESSIONS) > 100
    for file in SESSIONS:
        zmq_sessions(file.read_bytes())


def test_the_first_scripts_get_where_they_should():
    for script in SCRIPTS:
        zmq_sessions(script)


def test_a_stale_writer_is_found_out(monkeypatch):

    monkeypatch.setattr(RequestHandler, "end_session", lambda service, session: None)
    with pytest.raises(AssertionError, match="a stale writer"):
        zmq_sessions(bytes((4, 0, 64, 28, 0, 3)))  # opens for writing, says Bye
