"""The ZeroMQ server of a daemon."""

from __future__ import annotations

from cxbridge.blackboard.zmq.security import CurveServer
from cxbridge.blackboard.zmq.server import MOST_CONNECTIONS, ZmqBlackBoardServer
from cxbridge.daemon.servers.server import ServerComponent
from cxbridge.process.file_limit import ZMQ_SHARE, raise_file_limit, share


class ZmqComponent(ServerComponent[ZmqBlackBoardServer]):
    """Serves the blackboard over ZeroMQ."""

    def make(self) -> ZmqBlackBoardServer:
        """Make the server, with CURVE if there are keys."""
        settings, keys = self._daemon.settings, None
        if settings.secret_key is not None and settings.clients is not None:
            keys = CurveServer(settings.secret_key, settings.clients)
        return ZmqBlackBoardServer(
            self._daemon.board,
            list(settings.endpoints),
            keys=keys,
            insecure=settings.insecure,
            rights=settings.rights,
            most_connections=share(raise_file_limit(), MOST_CONNECTIONS, ZMQ_SHARE),
        )

    def endpoints(self, server: ZmqBlackBoardServer) -> list[str]:
        """Return the URLs, with the ports that were free."""
        return server.endpoints
