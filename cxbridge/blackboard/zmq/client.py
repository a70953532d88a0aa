"""A blackboard whose interfaces live at a server, reached over ZeroMQ."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Final
from uuid import UUID

from cxbridge.blackboard.base import BlackBoard, Registry
from cxbridge.blackboard.errors import BlackBoardGoneError, ForeignInstanceError
from cxbridge.blackboard.listeners import Listen, ListenerTable
from cxbridge.blackboard.memory import InterfaceInfo
from cxbridge.blackboard.observers import Observer
from cxbridge.blackboard.zmq.codec import Code, Stamp
from cxbridge.blackboard.zmq.dataframes import Frame, Send
from cxbridge.blackboard.zmq.dispatcher import Dispatcher
from cxbridge.blackboard.zmq.errors import DisconnectedError, TransportError
from cxbridge.blackboard.zmq.incoming import Incoming
from cxbridge.blackboard.zmq.link import Link
from cxbridge.blackboard.zmq.mirror import Mirror
from cxbridge.blackboard.zmq.outbox import Outbox
from cxbridge.blackboard.zmq.refusals import raise_refusal
from cxbridge.blackboard.zmq.security import CurveClient, check_endpoint, is_local
from cxbridge.blackboard.zmq.sockets import context_for
from cxbridge.clock import Clock
from cxbridge.events import EventBus
from cxbridge.interfaces.instance import Interface, Message

if TYPE_CHECKING:
    import zmq

_STAMPS: Final = {None: Stamp.COMPARE, False: Stamp.OLD, True: Stamp.NEW}


class ZmqBlackBoard(BlackBoard):
    """A blackboard at a :class:`~cxbridge.blackboard.zmq.ZmqBlackBoardServer`.

    What differs from a local one: listeners and observers are called in a thread of its own (of own writes
    in the thread that writes), soon after the event. :meth:`flush` waits for that. Whatever asks the server
    takes ``timeout`` at most. A lost connection comes back by itself; docs/protocol-zmq.md says what
    happens meanwhile.

    :param url: ``tcp://host:port``, ``ipc://path`` or ``inproc://name``.
    :param registry: gives the classes of types that are named by a string.
    :param clock: gives time stamps.
    :param bus: gets log lines; writes are told to the bus of the server's blackboard.
    :param name: tells people at the server who this is.
    :param heartbeat: seconds; the server may want a shorter one.
    :param timeout: seconds that a request may take.
    :param connect_timeout: seconds that connecting may take at the beginning.
    :param keys: for servers beyond this machine.
    :param insecure: connect beyond this machine without keys.
    :param context: of ZeroMQ; None: its own, or the process' own for inproc.
    :raises InsecureEndpointError: when the URL needs keys.
    :raises DisconnectedError: when no server answers.
    """

    tells_writes = False

    def __init__(  # noqa: PLR0913 - settings, by name
        self,
        url: str,
        registry: Registry,
        clock: Clock,
        bus: EventBus | None = None,
        *,
        name: str = "",
        heartbeat: float = 1.0,
        timeout: float = 5.0,
        connect_timeout: float = 5.0,
        keys: CurveClient | None = None,
        insecure: bool = False,
        context: zmq.Context[zmq.Socket[bytes]] | None = None,
    ) -> None:
        check_endpoint(url, keys=keys is not None, insecure=insecure)
        super().__init__(registry, clock, bus)
        self.url: Final = url
        self.timeout: Final = timeout
        self._context, self._own_context = context_for(context, [url])
        self._gone = False
        self._ending = threading.Lock()
        self._dispatcher = Dispatcher(f"{COMPONENT_THREAD} {url}", self._report_fault)
        self._outbox = Outbox(self._dispatcher)
        self._incoming = Incoming(self, self._outbox, self._dispatcher, self._observers, self._warn)
        self._link = Link(
            url,
            self._incoming,
            self._outbox,
            self._dispatcher,
            self._context,
            heartbeat=heartbeat,
            name=name,
            keys=keys,
        )
        self._incoming.hurry = self._link.hurry
        self._link.start()
        if not self._outbox.wait_ready(time.monotonic() + connect_timeout):
            reason = self._incoming.reason
            self.shutdown()
            raise DisconnectedError(
                f"no blackboard answers at {url}",
                hint=_why_nobody_answers(reason, url, keys),
            )

    # -- opening and closing

    def _open(
        self,
        interface_class: type[Interface],
        interface_id: str,
        owner: str,
        *,
        writer: bool,
        queue_limit: int | None,
        listen: Listen | None,
    ) -> Interface:
        self._check_here()
        schema = interface_class.SCHEMA
        opened: list[Interface] = []

        def on_reply(frame: Frame) -> None:
            if frame.body.code == Code.OK:
                opened.append(
                    self._incoming.enter(
                        interface_class, interface_id, owner, writer, queue_limit, frame, listen
                    )
                )

        body = {
            "type": schema.name,
            "id": interface_id,
            "hash": schema.hash,
            "size": schema.datasize,
            "owner": owner,
            "writer": writer,
        }
        reply = self._request("open", body, on_reply=on_reply)
        if not opened:
            raise_refusal(reply, uid=f"{schema.name}::{interface_id}", hash_=schema.hash)
        return opened[0]

    def close(self, instance: Interface) -> None:
        """Close an instance; see the base class."""
        if not instance.valid:
            return
        if not self._incoming.owns(instance):
            raise ForeignInstanceError(instance.uid)
        mirror = self._incoming.start_closing(instance)

        def on_reply(frame: Frame) -> None:
            self._incoming.finish_closing(mirror, instance, frame.body.detail)

        try:
            self._outbox.request(
                "close",
                {"instance": instance.serial.bytes},
                timeout=self.timeout if self._outbox.ready else 0.0,
                repeat=False,
                on_reply=on_reply,
            )
        except TransportError:  # the server does it when it finds that the session is dead
            self._incoming.finish_closing(mirror, instance, mirror.seq)
        self._dispatcher.drain(self.timeout)

    def shutdown(self) -> None:
        """Make all instances invalid, end the session and give everything back."""
        with self._ending:
            if self._gone:
                return
            self._gone = True
        self._incoming.invalidate_all()
        self._outbox.close()
        self._link.stop()
        self._dispatcher.stop()
        if self._own_context:
            self._context.term()

    def _check_here(self) -> None:
        if self._gone:
            raise BlackBoardGoneError

    def _request(self, kind: str, body: dict[str, Any] | Send, **options: Any) -> Frame:
        return self._outbox.request(kind, body, timeout=self.timeout, **options)

    # -- looking around

    def list(self, type_glob: str = "*", id_glob: str = "*") -> Sequence[InterfaceInfo]:
        """Return what there is to tell of the interfaces that match; see the base class."""
        self._check_here()
        reply = self._request("list", {"type_glob": type_glob, "id_glob": id_glob})
        return [
            InterfaceInfo(
                type=info.type,
                id=info.id,
                hash=info.hash,
                serial=info.serial,
                has_writer=info.has_writer,
                writer=info.writer,
                readers=tuple(info.readers),
                timestamp_us=info.timestamp_us,
            )
            for info in reply.body.interfaces
        ]

    @property
    def connected(self) -> bool:
        """Whether there is a session with the server now."""
        return self._outbox.ready

    def on_connection(self, callback: Callable[[bool], None]) -> None:
        """Tell of a lost session, and of the one after it; see the base class."""
        self._incoming.on_connection.append(callback)

    @property
    def skipped(self) -> int:
        """How many updates were conflated on their way to this client, and in it."""
        return self._incoming.skipped

    def flush(self, timeout: float | None = None) -> None:
        """Return when everything done here has reached the server, and what it sent before was told here.

        :param timeout: seconds; None: that of requests.
        :raises TransportError: when it takes too long.
        """
        self._check_here()
        seconds = self.timeout if timeout is None else timeout
        self._incoming.wait_written(seconds)
        self._outbox.request("sync", {}, timeout=seconds)
        self._dispatcher.drain(seconds)

    # -- being told

    def _listeners_of(self, instance: Interface) -> ListenerTable:
        mirror = self._incoming.mirror_of(instance)
        if mirror is None:
            raise ForeignInstanceError(instance.uid)
        return mirror.listeners

    def register_observer(self, observer: Observer, type_glob: str = "*", id_glob: str = "*") -> None:
        """Tell ``observer`` of interfaces that come into being or vanish; see the base class."""
        self._check_here()
        super().register_observer(observer, type_glob, id_glob)
        watching = self._incoming.watching
        if not watching.on:
            self._request("watch", {}, on_reply=watching.began)

    # -- what mirrors ask

    def send_write(
        self, mirror: Mirror, serial: UUID, block: bytes, stamped: bool | None, changed: bool
    ) -> None:
        """Send a block; when there is no room, or no session, only the last one."""
        self._incoming.write(mirror, serial, _STAMPS[stamped], changed, block)

    def note_skipped(self) -> None:
        """Count an update that listeners do not hear of, as they are too slow."""
        self._incoming.skipped += 1

    def send_message(self, sender: Interface, message: Message) -> None:
        """Send a message and wait until it is in the writer's queue.

        :raises NoWriterError: when there is no writer.
        :raises QueueFullError: when its queue is bounded and full.
        :raises RequestTimeoutError: when the writer or the server does not answer in time.
        :raises DisconnectedError: when there is no session; it may have been delivered.
        """
        source = message.source_id or sender.serial
        body = Send(
            request=0,
            instance=sender.serial.bytes,
            source=source.bytes,
            type=message.type,
            id=message.id,
            thread=message.sender_thread_name,
            hops=message.hops,
        )
        reply = self._request("send", body, block=message.to_bytes(), repeat=False)
        code = reply.body.code
        if code == Code.OK:
            message.mark_enqueued(self.clock.now_us())
        elif code != Code.DECLINED:
            if code == Code.NO_WRITER:
                self._warn(
                    f"Cannot transmit message from sender {message.sender_thread_name} via interface "
                    f"{sender.id} (type {sender.type}), no writing instance exists!"
                )
            raise_refusal(reply, uid=sender.uid, message_type=message.type, serial=sender.serial)


def _why_nobody_answers(reason: str, url: str, keys: CurveClient | None) -> str:
    """Return what to look at; a server with CURVE keys leaves strangers without an answer and a reason."""
    reason = reason or "is the daemon running, and at this address?"
    if keys is not None:
        wrong = f"it does not know our key, or its key is not {keys.server_key}"
        return f"{reason}; it does not answer either when {wrong}"
    if not is_local(url):
        return f"{reason}; it does not answer either when it wants CURVE keys"
    return reason


COMPONENT_THREAD: Final = "BlackBoard events"
"""Beginning of the name of the thread that calls listeners."""
