"""All tests here find out when two threads are in one socket."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.blackboard.zmq.threads import SocketUse, watched_sockets


@pytest.fixture(autouse=True)
def socket_use() -> Iterator[SocketUse]:
    """Fail a test in which two threads were in one socket at once."""
    with watched_sockets() as use:
        yield use
