"""Clients of a server on each ZeroMQ transport, compared with the model of all blackboards."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import ClassVar

from tests.blackboard.machine import SETTINGS, Machine
from tests.blackboard.sites import Site
from tests.blackboard.zmq.site import ZmqSite


class ZmqMachine(Machine):
    transport: ClassVar[str]

    def make_site(self, window: int) -> Site:
        self.folder = tempfile.TemporaryDirectory()
        return ZmqSite(self.transport, Path(self.folder.name), window)

    def teardown(self) -> None:
        super().teardown()
        self.folder.cleanup()


class IpcMachine(ZmqMachine):
    transport = "ipc"


class TcpMachine(ZmqMachine):
    transport = "tcp"


TestIpc, TestTcp = IpcMachine.TestCase, TcpMachine.TestCase
for case in (TestIpc, TestTcp):
    case.settings = SETTINGS
del case  # otherwise pytest would run it again
