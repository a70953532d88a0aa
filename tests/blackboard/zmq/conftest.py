"""All tests of this folder check for sockets in two threads."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.blackboard.zmq.threads import SocketUse, watched_sockets


@pytest.fixture(autouse=True)
def socket_use() -> Iterator[SocketUse]:
    """Fail a test in which two threads use a socket at once."""
    with watched_sockets() as use:
        yield use
