"""A ZeroMQ server without sockets and threads, and scripts of frames from several clients.

The input is a script: each step begins with a byte for the action, and a byte for the client. So the fuzzer
need not find the numbers of frames, serials and hashes, but a step may also send raw bytes.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable
from typing import Any, Final, cast
from unittest.mock import patch
from uuid import UUID

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.zmq import ZmqBlackBoardServer
from cxbridge.blackboard.zmq.server import sessions
from cxbridge.blackboard.zmq.server.sessions import ZmqSession
from cxbridge.blackboard.zmq.wire.frames import (
    COMMANDS_PREFIX,
    EVENTS_PREFIX,
    SERIAL_SIZE,
    Beat,
    Bye,
    Close,
    Credit,
    Delivered,
    Frame,
    Gone,
    Hello,
    List,
    Open,
    Reply,
    ResultCode,
    Send,
    Sync,
    Watch,
    Welcome,
    Write,
    decode_server_frame,
    encode,
)
from cxbridge.clock import VirtualClock
from cxbridge.interfaces import InterfaceRegistry

_CLIENT_COUNT: Final = 3
_MAX_STEPS: Final = 64  # of a script
_WINDOW: Final = 2  # unacknowledged updates of a client: few, so that scripts reach the limit
# the first types are known; the last two ids are invalid
_KNOWN_TYPES: Final = 2
_TYPES: Final = ("SkillerInterface", "Position3DInterface", "NoInterface", "")
_IDS: Final = ("a", "b", "\0", "x" * 65)
_REGISTRY: Final = InterfaceRegistry()
# frames without a parameter from the script; the last three are frames of a server
_REQUESTS: Final[tuple[Callable[[], Frame], ...]] = (
    lambda: Sync(request=1),
    lambda: Watch(request=1),
    Beat,
    Bye,
    lambda: List("*", "[a", request=1),
    lambda: Welcome(bytes(SERIAL_SIZE), 0, 0),
    lambda: Reply(request=1),
    lambda: Gone(ResultCode.OK, ""),
)


class _Wire:
    """Replaces a ROUTER socket, and collects the sent frames by route."""

    def __init__(self) -> None:
        self.sent: dict[bytes, list[bytes]] = {}
        self._parts: list[bytes] = []

    def send(self, data: bytes, flags: int = 0, *_: object) -> None:
        self._parts.append(data)
        if not flags & 2:  # ZMQ_SNDMORE
            route, *frames = self._parts
            self._parts = []
            self.sent.setdefault(route, []).append(frames[0])

    def send_multipart(self, parts: list[bytes], flags: int = 0) -> None:
        del flags
        self.sent.setdefault(parts[0], []).append(parts[1])


class _Wakeup:
    """Replaces the socket that wakes the server's thread, which the fuzzed server lacks."""

    def set(self) -> None:
        pass


class _Script:
    """The input as a stream of bytes; zeros after its end."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    def __bool__(self) -> bool:
        return self._at < len(self._data)

    def byte(self) -> int:
        """Return the next byte."""
        self._at += 1
        return self._data[self._at - 1] if self._at <= len(self._data) else 0

    def take(self) -> bytes:
        """Return bytes; the next two bytes are their number."""
        size = int.from_bytes((self.byte(), self.byte()), "big")
        data = self._data[self._at : self._at + size]
        self._at += size
        return data


class FuzzedServer:
    """A server with its clients; each step is followed by checks."""

    def __init__(self) -> None:
        numbers = itertools.count(1)
        self.board = LocalBlackBoard(_REGISTRY, VirtualClock(), serials=lambda: UUID(int=next(numbers)))
        # room for one session more than there are clients, so that scripts can reach the limit
        self.server: Any = ZmqBlackBoardServer(self.board, ["ipc:///nowhere"], window=_WINDOW, max_sessions=4)
        self.server._epoch = bytes(SERIAL_SIZE)  # noqa: SLF001 - as in start(), without sockets
        self.server._wakeup = cast("Any", _Wakeup())  # noqa: SLF001
        self.server._thread_id = threading.get_ident()  # noqa: SLF001
        self.board.register_observer(self.server)
        self.wire: Any = _Wire()
        self.local_instances: list[Any] = []
        self.generation = [0] * _CLIENT_COUNT

    def close(self) -> None:
        """Close all instances and sessions; check that the server is empty."""
        for instance in self.local_instances:
            instance.close()
        self.local_instances.clear()
        for session in self.sessions():
            self.server._end_session(session)  # noqa: SLF001
        self.server.run_posted_calls()
        self.check()
        service = self.server._requests  # noqa: SLF001
        assert not self.board.list_all(), "instances remain"
        assert not len(service.deliveries), "undelivered messages remain"
        assert not service._channels, "channels remain"  # noqa: SLF001
        self.board.unregister_observer(self.server)

    def sessions(self) -> list[ZmqSession]:
        """Return the open sessions."""
        return list(self.server._sessions.values())  # noqa: SLF001

    def name(self, client: int) -> bytes:
        """Return the name of a client's session, which changes with the generation of its Hello."""
        return bytes([client, self.generation[client]]).ljust(SERIAL_SIZE, b"s")

    # -- steps

    def step(self, script: _Script) -> None:
        """Run a step; an exception that it raises is a failure."""
        action, client_byte = script.byte(), script.byte()
        client = client_byte % _CLIENT_COUNT
        match action % 4:
            case 0 | 1:
                self.request(action >> 2, client, script)
            case 2:
                self.say_hello(client, client_byte >> 4, replaces=bool(action & 64))
            case _:
                self.disturb(action >> 2, client_byte, script)

    def request(self, kind: int, client: int, script: _Script) -> None:
        """Send a frame of a client with the next number of its session.

        :param kind: selects the kind of the frame, modulo 8.
        """
        session = self.server._sessions.get(self.name(client))  # noqa: SLF001
        number = 1 if session is None else session.last_number_received + 1
        frame: Frame
        match kind % 8:
            case 0 | 1:
                frame = self.open_frame(script)
            case 2:
                frame = Close(self.serial(session, script), request=1)
            case 3:
                serial, block = self.serial(session, script), self.block(session, script)
                flags = script.byte()
                frame = Write(serial, (None, False, True)[flags % 3], bool(flags & 1), block)
            case 4:
                frame = self.send_frame(session, script)
            case 5:
                frame = Credit(script.byte())
            case 6:
                delivery_number, code = script.byte(), script.byte() % len(ResultCode)
                frame = Delivered(delivery_number, ResultCode(code), script.byte())
            case _:
                frame = _REQUESTS[script.byte() % len(_REQUESTS)]()
        frame.number = number
        self.handle_message(COMMANDS_PREFIX + self.name(client), [encode(frame)])

    def disturb(self, kind: int, client_byte: int, script: _Script) -> None:
        """Send raw bytes, run an action of the server's process, or let time pass.

        :param kind: selects one of these, modulo 4.
        """
        name = self.name(client_byte % _CLIENT_COUNT)
        match kind % 4:
            case 0:
                frames = [script.take() for _ in range(1 + (client_byte >> 5) % 3)]
                self.handle_message((COMMANDS_PREFIX, EVENTS_PREFIX)[client_byte >> 7] + name, frames)
            case 1:
                session = self.server._sessions.get(name)  # noqa: SLF001
                number = 1 if session is None else session.last_number_received + 1
                data = script.take()
                # a data frame ends with its number, which is a single byte in MessagePack up to 127
                self.handle_message(COMMANDS_PREFIX + name, [data + bytes([number & 127])])
            case 2:
                self.act_locally(script)
            case _:
                now = time.monotonic() + script.byte() / 16  # up to 16 seconds later, in fine steps
                self.server._check_sessions(now, 0.0)  # noqa: SLF001

    def say_hello(self, client: int, generation: int, *, replaces: bool) -> None:
        """Begin a session of a client, the same session again or another session."""
        before = self.name(client) if replaces else b""
        self.generation[client] = generation
        hello = Hello(self.name(client), replaces=before, name=f"client {client}")
        self.handle_message(EVENTS_PREFIX + self.name(client), [encode(hello)])

    def open_frame(self, script: _Script) -> Open:
        """Return an Open of a known or an unknown type.

        A byte selects type, id, a wrong hash (bit 7) and whether the instance writes (bit 6).
        """
        choice = script.byte()
        type_ = _TYPES[choice % len(_TYPES)]
        schema: Any = _REGISTRY.get(type_).SCHEMA if choice % len(_TYPES) < _KNOWN_TYPES else None
        hash_ = bytes(16) if schema is None or choice & 128 else schema.hash
        size = 0 if schema is None else schema.datasize
        return Open(type_, _IDS[choice // 4 % len(_IDS)], hash_, size, "owner", bool(choice & 64), request=1)

    def send_frame(self, session: ZmqSession | None, script: _Script) -> Send:
        """Return a Send with or without a matching instance."""
        serial = self.serial(session, script)
        instance: Any = None if session is None else session.instances.get(serial)
        types = [] if instance is None else list(instance.MESSAGES.values())
        if types:
            message = types[script.byte() % len(types)]()
            type_, block = message.type, message.to_bytes()
        else:
            type_, block = "NoMessage", script.take()
        hops = (1 << 32) - 1 if script.byte() & 1 else 0
        return Send(serial, serial, type_, 7, "thread", hops, block, request=1)

    def serial(self, session: ZmqSession | None, script: _Script) -> bytes:
        """Return the serial of an instance of the session, or another serial."""
        choice = script.byte()
        own = [] if session is None else list(session.instances)
        if own and choice < 192:  # noqa: PLR2004 - larger bytes are other serials
            return own[choice % len(own)]
        return UUID(int=choice).bytes

    def block(self, session: ZmqSession | None, script: _Script) -> bytes:
        """Return a block, usually with the size of an instance; bytes from 224 on are other sizes."""
        choice = script.byte()
        sizes = [] if session is None else [i.SCHEMA.datasize for i in session.instances.values()]
        return bytes([choice]) * (sizes[choice % len(sizes)] if sizes and choice < 224 else choice)  # noqa: PLR2004

    def handle_message(self, route: bytes, frames: list[bytes]) -> None:
        """Let the server handle an incoming message."""
        try:
            self.server._handle_message(self.wire, route, frames[0], len(frames) - 1)  # noqa: SLF001
        except ProtocolError as error:
            self.server._dismiss_client(self.wire, route, ResultCode.PROTOCOL, error.message)  # noqa: SLF001
        self.server._end_failed()  # noqa: SLF001

    def act_locally(self, script: _Script) -> None:
        """Open, write, send or close an instance in the server's process."""
        choice = script.byte()
        try:
            if choice % 4 == 0 and len(self.local_instances) < 8:  # noqa: PLR2004 - few, so that a step is fast
                opener = self.board.open_for_writing if choice & 4 else self.board.open_for_reading
                self.local_instances.append(
                    opener(_TYPES[choice >> 3 & 1], _IDS[choice >> 4 & 1], owner="local")
                )
            elif self.local_instances:
                instance = self.local_instances[choice // 4 % len(self.local_instances)]
                if choice % 4 == 1:
                    instance.close()
                    self.local_instances.remove(instance)
                elif instance.is_writer:
                    instance.mark_data_refreshed()
                    instance.write()
                    for _ in range(instance.msgq_size()):  # forwarded messages may return
                        self.forward(instance.msgq_pop())
                elif instance.MESSAGES:
                    instance.msgq_enqueue(next(iter(instance.MESSAGES.values()))())
        except BlackBoardError:
            pass  # an expected error, such as a second writer

    def forward(self, message: Any) -> None:
        """Send a message on through the first local reader whose interface has its type, as a proxy does."""
        for reader in self.local_instances:
            if not reader.is_writer and message.type in reader.MESSAGES:
                reader.msgq_enqueue(message.copy(), proxy=True)
                return

    # -- invariants after each step

    def check(self) -> None:
        """Check that the records of the server agree with each other and with the blackboard."""
        remote = [instance for session in self.sessions() for instance in session.instances.values()]
        reader_count = writer_count = 0
        for info in self.board.list_all():
            reader_count += info.num_readers
            writer_count += info.has_writer
        instances = remote + self.local_instances
        assert writer_count == sum(instance.is_writer for instance in instances), "a stale writer, or two"
        assert reader_count == sum(not instance.is_writer for instance in instances), "a stale reader"
        assert len(remote) == sum(
            len(membership.instance_serials)
            for session in self.sessions()
            for membership in session.memberships.values()
        )
        for session in self.sessions():
            assert 0 <= session.credit <= _WINDOW
            assert session.pending_count >= 0
            for channel in session.waiting_channels:
                assert channel in session.memberships
        self.check_sent()

    def check_sent(self) -> None:
        """Check that the sent frames are valid."""
        for route, frames in self.wire.sent.items():
            assert route[:1] == EVENTS_PREFIX
            for frame in frames:
                decode_server_frame(frame)
        self.wire.sent.clear()


# The bytes of the seeds: actions as `step`, `request` and `disturb` decode them.
WRITER, READER = 64, 0  # added to the index of a type, and four times the index of an id
_OPEN, _CLOSE, _WRITE, _SEND, _CREDIT, _DELIVERED, _PLAIN_REQUEST = (4 * kind for kind in range(1, 8))
_REPLACE_SESSION = 66
_SEND_RAW, _SEND_NUMBERED, _ACT_LOCALLY, _WAIT = (3 + 4 * kind for kind in range(4))
_OPEN_BOTH: Final = (_OPEN, 0, WRITER, _OPEN, 1, READER)  # client 0 opens for writing, client 1 for reading
SCRIPTS: Final = tuple(
    bytes(script)
    for script in (
        (*_OPEN_BOTH, _WRITE, 0, 0, 0, 2, _WRITE, 0, 0, 0, 2, _CREDIT, 1, 2),
        (*_OPEN_BOTH, _WRITE, 0, 0, 0, 2, _WRITE, 0, 0, 0, 2, _WRITE, 0, 0, 0, 2,
         _OPEN, 1, READER, _CREDIT, 1, 9),
        (*_OPEN_BOTH, _SEND, 1, 0, 0, 0, _DELIVERED, 0, 1, 0, 0),
        (*_OPEN_BOTH, _SEND, 1, 0, 0, 0, _REPLACE_SESSION, 16, _OPEN, 1, WRITER),
        (_OPEN, 0, WRITER, _OPEN, 1, WRITER, _CLOSE, 0, 0, _OPEN, 1, WRITER, _PLAIN_REQUEST, 1, 3),
        (_ACT_LOCALLY, 0, 4, _OPEN, 1, READER, _SEND, 1, 0, 0, 0, _ACT_LOCALLY, 0, 2, _WAIT, 0, 255),
        (_PLAIN_REQUEST, 0, 1, _OPEN, 1, READER, _CLOSE, 1, 0, _PLAIN_REQUEST, 1, 4,
         _SEND_RAW, 0, 0, 3, 1, 2, 3, _SEND_NUMBERED, 1, 0, 2, 0xC1, 2),
    )
)  # fmt: skip
"""Seeds: scripts that have all kinds of steps."""


def zmq_sessions(data: bytes) -> None:
    """Run a script; the server's state must stay consistent, and be empty at the end."""
    with patch.object(sessions, "raw_send", lambda wire: wire.send):  # _Wire is no real socket
        server = FuzzedServer()
        script = _Script(data)
        for client in range(_CLIENT_COUNT - 1):  # a script need not begin with Hello
            server.say_hello(client, 0, replaces=False)
        for _ in range(_MAX_STEPS):
            if not script:
                break
            server.step(script)
            server.check()
        server.close()
