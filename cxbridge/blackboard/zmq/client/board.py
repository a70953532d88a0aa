"""The blackboard of a client, callable from any thread.

The other modules of this package have the state of the session.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Final

from cxbridge.blackboard.base import OpenRequest, Registry
from cxbridge.blackboard.errors import ForeignInstanceError
from cxbridge.blackboard.info import InterfaceInfo
from cxbridge.blackboard.kit.board import RemoteBlackBoard
from cxbridge.blackboard.kit.errors import DisconnectedError, RemoteRefusalError, TransportError
from cxbridge.blackboard.kit.wakeup import SocketWakeup
from cxbridge.blackboard.listeners import ListenerTable, Observer
from cxbridge.blackboard.zmq.client.interfaces import OpenInterfaces
from cxbridge.blackboard.zmq.client.receiving import EventReceiver
from cxbridge.blackboard.zmq.client.sending import CommandSender
from cxbridge.blackboard.zmq.client.session import NO_REPLY, SessionThread
from cxbridge.blackboard.zmq.security import CurveClient, check_endpoint
from cxbridge.blackboard.zmq.wire.frames import Close, List, Listed, Reply, Response, Sync, Watch
from cxbridge.blackboard.zmq.wire.sockets import make_context
from cxbridge.clock import Clock
from cxbridge.errors import BlackBoardError
from cxbridge.events import EventBus
from cxbridge.interfaces.instance import Interface


class ZmqBlackBoard(RemoteBlackBoard):
    """A client's access to the blackboard of a :class:`~cxbridge.blackboard.zmq.ZmqBlackBoardServer`.

    A dispatcher thread calls listeners and observers, soon after the event; only for a write of this client,
    the writing thread calls the listeners, as on a local blackboard. A request takes at most ``timeout``. The
    client restores a lost connection, see docs/evidence/protocol-zmq.md.

    :param url: ``tcp://host:port`` or ``ipc://path``.
    :param registry: returns the classes of types that are named by a string.
    :param bus: gets log lines; the server's blackboard emits writes on its bus.
    :param name: identifies the client in log lines of the server.
    :param timeout: the limit of a request, in seconds.
    :param connect_timeout: the limit of the first connection, in seconds.
    :param keys: the CURVE keys, required for servers on other machines.
    :param insecure: whether servers on other machines are allowed without keys.
    :raises InsecureEndpointError: if the URL needs keys.
    :raises EndpointError: if the URL is invalid, or on Windows.
    :raises DisconnectedError: if no session begins within ``connect_timeout``, e.g. because no server
        replies, or a key file is unusable.
    """

    reports_writes = False  # the server's blackboard emits the writes, on its bus

    def __init__(  # noqa: PLR0913 - all settings are passed by name
        self,
        url: str,
        registry: Registry,
        clock: Clock,
        bus: EventBus | None = None,
        *,
        name: str = "",
        timeout: float = 5.0,
        connect_timeout: float = 5.0,
        keys: CurveClient | None = None,
        insecure: bool = False,
    ) -> None:
        check_endpoint(url, has_keys=keys is not None, is_insecure_allowed=insecure)
        super().__init__(registry, clock, bus)
        self._timeout_s: Final = timeout
        self._context = make_context()
        wakeup = SocketWakeup()
        self._dispatcher: EventReceiver = EventReceiver(
            f"BlackBoard events {url}", self.report_fault, self._context, wakeup.set
        )
        self._sender = CommandSender(self._dispatcher)
        self._interfaces = OpenInterfaces(self, url, timeout, self._sender, self._dispatcher, self._observers)
        self._session = SessionThread(
            url,
            self._interfaces,
            self._sender,
            self._dispatcher,
            wakeup,
            name=name,
            keys=keys,
        )
        self._session.start()
        if not self._sender.wait_ready(time.monotonic() + connect_timeout):
            reason = self._interfaces.end_reason
            self.shutdown()
            if reason in ("", NO_REPLY):
                reason = (
                    "'cxbridge daemon' starts a daemon; --connect URL names the address of a running daemon"
                )
            key_hint = "a server that requires CURVE keys stays silent if a key is missing or wrong"
            raise DisconnectedError(f"no blackboard replies at {url}", hint=f"{reason}; {key_hint}")

    def _open(self, request: OpenRequest) -> Interface:
        self._check_open()
        return self._interfaces.open(request)

    def close(self, instance: Interface) -> None:
        if not instance.valid:
            return
        if not self._interfaces.has_instance(instance):
            raise ForeignInstanceError(instance.uid)
        copy = self._interfaces.start_closing(instance)

        def on_reply(reply: Response) -> None:
            if isinstance(reply, Reply):
                self._interfaces.finish_closing(copy, instance, reply.detail)

        try:
            self._sender.request(
                Close(instance.serial.bytes),
                timeout_s=self._timeout_s if self._sender.is_ready else 0.0,
                repeat=False,
                on_reply=on_reply,
            )
        except TransportError:  # the server closes the instance at the end of the session at the latest
            self._interfaces.finish_closing(copy, instance, copy.seq)
        # wait for the queued call of `finish_closing`, which unregisters the listeners
        self._dispatcher.drain(self._timeout_s)

    def _shut_down(self) -> None:
        # the sender before the session's thread: the sender releases the callers that wait for a session
        self._interfaces.invalidate_all()
        self._sender.close()
        self._session.stop()
        self._dispatcher.stop()
        self._context.term()

    def list(self, type_glob: str = "*", id_glob: str = "*") -> Sequence[InterfaceInfo]:
        self._check_open()
        reply = self._sender.request(List(type_glob, id_glob), timeout_s=self._timeout_s)
        if isinstance(reply, Reply):
            raise RemoteRefusalError(reply.text)
        assert isinstance(reply, Listed)
        return reply.interfaces

    @property
    def connected(self) -> bool:
        """Whether the client has a session with the server."""
        return self._sender.is_ready

    @property
    def skipped(self) -> int:
        """The number of updates that were conflated on the way to this client or in it."""
        return self._interfaces.skipped

    def flush(self, timeout: float | None = None) -> None:
        """Wait until the server has received all earlier calls and listeners have handled all earlier events.

        Within a listener, the method waits only for the server.

        :param timeout: the limit in seconds for each of the two waits; by default the timeout of requests.
        :raises TransportError: if the server does not reply.
        :raises BlackBoardError: if the listeners take too long.
        :raises BlackBoardGoneError: after the shutdown.
        """
        self._check_open()
        timeout_s = self._timeout_s if timeout is None else timeout
        self._sender.request(Sync(), timeout_s=timeout_s)
        if not self._dispatcher.drain(timeout_s):
            raise BlackBoardError(f"listeners have been busy for {timeout_s:g} s")

    def _listener_table(self, instance: Interface) -> ListenerTable:
        copy = self._interfaces.find_copy(instance)
        if copy is None:
            raise ForeignInstanceError(instance.uid)
        return copy.listeners

    def register_observer(self, observer: Observer, type_glob: str = "*", id_glob: str = "*") -> None:
        self._check_open()
        super().register_observer(observer, type_glob, id_glob)
        if not self._interfaces.is_watching:
            self._sender.request(
                Watch(), timeout_s=self._timeout_s, on_reply=self._interfaces.handle_existing
            )
