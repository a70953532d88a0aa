"""The component of a daemon that serves its blackboard over ZeroMQ."""

from __future__ import annotations

from cxbridge.blackboard.zmq.security import CurveServer
from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
from cxbridge.daemon.daemon import Daemon
from cxbridge.run.components.component import Component


class ZmqComponent(Component):
    """Serves the blackboard over ZeroMQ, with CURVE if there are keys."""

    steady = True  # clients resume a paused daemon over this server

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon

    def activate(self) -> None:
        settings, keys = self._daemon.settings, None
        if settings.secret_key is not None and settings.clients is not None:
            keys = CurveServer(settings.secret_key, settings.clients)
        # a new server each time, because a stopped server does not start again
        self._server = ZmqBlackBoardServer(
            self._daemon.board,
            list(settings.endpoints),
            keys=keys,
            insecure=settings.insecure,
            rights=settings.rights,
        )
        self._server.start()
        self._daemon.add_endpoints(self._server.endpoints)

    def deactivate(self) -> None:
        self._server.stop()
