"""A server of ZeroMQ without sockets and threads, and sequences of frames from several clients for it.

The input is a script: each step begins with a byte that says what is done, and a byte that says by whom. So
the fuzzer need not find the numbers of frames, serials and hashes by itself, but it may put anything in their
place: a step can also send raw bytes.
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

_CLIENTS: Final = 3
_STEPS: Final = 64
_WINDOW: Final = 2
_TYPES: Final = ("SkillerInterface", "Position3DInterface", "NoInterface", "")
_IDS: Final = ("a", "b", "\0", "x" * 65)
_REGISTRY: Final = InterfaceRegistry()
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
    """Stands for a ROUTER: keeps what is sent by route."""

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
    def set(self) -> None:
        pass


class _Script:
    """The input, taken from its beginning; zeros when it is at its end."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    def __bool__(self) -> bool:
        return self._at < len(self._data)

    def byte(self) -> int:
        self._at += 1
        return self._data[self._at - 1] if self._at <= len(self._data) else 0

    def take(self) -> bytes:
        """Return as many bytes as the next two say."""
        size = int.from_bytes((self.byte(), self.byte()), "big")
        taken = self._data[self._at : self._at + size]
        self._at += size
        return taken


class Fuzzed:
    """The server and what its clients know; each step is checked."""

    def __init__(self) -> None:
        numbers = itertools.count(1)
        self.board = LocalBlackBoard(_REGISTRY, VirtualClock(), serials=lambda: UUID(int=next(numbers)))
        self.server: Any = ZmqBlackBoardServer(self.board, ["ipc:///nowhere"], window=_WINDOW, max_sessions=4)
        self.server._epoch = bytes(SERIAL_SIZE)  # noqa: SLF001 - what start() does, without sockets
        self.server._wakeup = cast("Any", _Wakeup())  # noqa: SLF001
        self.server._thread_id = threading.get_ident()  # noqa: SLF001
        self.board.register_observer(self.server)
        self.wire: Any = _Wire()
        self.local: list[Any] = []
        self.generation = [0] * _CLIENTS

    def close(self) -> None:
        """End what is open; nothing may be left."""
        for instance in self.local:
            instance.close()
        self.local.clear()
        for session in self.sessions():
            self.server._end_session(session)  # noqa: SLF001
        self.server.run_posted_calls()
        self.check()
        service = self.server._requests  # noqa: SLF001
        assert not self.board.list_all(), "instances are left"
        assert not len(service.deliveries), "messages under way are left"
        assert not service._channels, "channels are left"  # noqa: SLF001
        self.board.unregister_observer(self.server)

    def sessions(self) -> list[ZmqSession]:
        """Return the sessions that there are."""
        return list(self.server._sessions.values())  # noqa: SLF001

    def name(self, client: int) -> bytes:
        """Return the session of a client: another one after each Hello that says so."""
        return bytes([client, self.generation[client]]).ljust(SERIAL_SIZE, b"s")

    # -- steps

    def step(self, script: _Script) -> None:
        """Do one step; what is not ours to raise comes through."""
        what, who = script.byte(), script.byte()
        client = who % _CLIENTS
        match what % 4:
            case 0 | 1:
                self.request(what >> 2, client, script)
            case 2:
                self.say_hello(client, who >> 4, replaces=bool(what & 64))
            case _:
                self.disturb(what >> 2, who, script)

    def request(self, what: int, client: int, script: _Script) -> None:
        """Let a client send what clients send."""
        session = self.server._sessions.get(self.name(client))  # noqa: SLF001
        number = 1 if session is None else session.last_number_received + 1
        frame: Frame
        match what % 8:
            case 0 | 1:
                frame = self.open_frame(script)
            case 2:
                frame = Close(self.serial(session, script), request=1)
            case 3:
                serial, block = self.serial(session, script), self.block(session, script)
                stamp = script.byte()
                frame = Write(serial, (None, False, True)[stamp % 3], bool(stamp & 1), block)
            case 4:
                frame = self.send_frame(session, script)
            case 5:
                frame = Credit(script.byte())
            case 6:
                number_of_delivery, code = script.byte(), script.byte() % len(ResultCode)
                frame = Delivered(number_of_delivery, ResultCode(code), script.byte())
            case _:
                frame = _REQUESTS[script.byte() % len(_REQUESTS)]()
        frame.number = number
        self.take(COMMANDS_PREFIX + self.name(client), [encode(frame)])

    def disturb(self, what: int, who: int, script: _Script) -> None:
        """Send raw bytes, let the server's process do something, or let time pass."""
        name = self.name(who % _CLIENTS)
        match what % 4:
            case 0:
                frames = [script.take() for _ in range(1 + (who >> 5) % 3)]
                self.take((COMMANDS_PREFIX, EVENTS_PREFIX)[who >> 7] + name, frames)
            case 1:
                session = self.server._sessions.get(name)  # noqa: SLF001
                number = 1 if session is None else session.last_number_received + 1
                data = script.take()
                self.take(COMMANDS_PREFIX + name, [data + bytes([number & 127])])
            case 2:
                self.act_here(script)
            case _:
                now = time.monotonic() + script.byte() / 16
                self.server._check_sessions(now, 0.0)  # noqa: SLF001

    def say_hello(self, client: int, generation: int, *, replaces: bool) -> None:
        """Let a client begin a session, the same one again or another one."""
        before = self.name(client) if replaces else b""
        self.generation[client] = generation
        hello = Hello(self.name(client), replaces=before, name=f"client {client}")
        self.take(EVENTS_PREFIX + self.name(client), [encode(hello)])

    def open_frame(self, script: _Script) -> Open:
        """Return an Open of something that may be there or not."""
        how = script.byte()
        type_ = _TYPES[how % len(_TYPES)]
        schema: Any = _REGISTRY.get(type_).SCHEMA if how % len(_TYPES) < 2 else None  # noqa: PLR2004
        hash_ = bytes(16) if schema is None or how & 128 else schema.hash
        size = 0 if schema is None else schema.datasize
        return Open(type_, _IDS[how // 4 % len(_IDS)], hash_, size, "somebody", bool(how & 64), request=1)

    def send_frame(self, session: ZmqSession | None, script: _Script) -> Send:
        """Return a Send that fits an instance, or does not."""
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
        """Return the serial of an instance of a session, or of somebody else."""
        which = script.byte()
        own = [] if session is None else list(session.instances)
        if own and which < 192:  # noqa: PLR2004 - else it may be a stranger's
            return own[which % len(own)]
        return UUID(int=which).bytes

    def block(self, session: ZmqSession | None, script: _Script) -> bytes:
        """Return a block that fits an instance, mostly."""
        which = script.byte()
        fits = [] if session is None else [i.SCHEMA.datasize for i in session.instances.values()]
        return bytes([which]) * (fits[which % len(fits)] if fits and which < 224 else which)  # noqa: PLR2004

    def take(self, route: bytes, frames: list[bytes]) -> None:
        """Let the server take a message, as it does when one comes in."""
        try:
            self.server._handle_message(self.wire, route, frames[0], len(frames) - 1)  # noqa: SLF001
        except ProtocolError as error:
            self.server._dismiss_client(self.wire, route, ResultCode.PROTOCOL, error.message)  # noqa: SLF001
        self.server._end_failed()  # noqa: SLF001

    def act_here(self, script: _Script) -> None:
        """Let the server's own process open, write, send or close."""
        how = script.byte()
        try:
            if how % 4 == 0 and len(self.local) < 8:  # noqa: PLR2004
                opener = self.board.open_for_writing if how & 4 else self.board.open_for_reading
                self.local.append(opener(_TYPES[how >> 3 & 1], _IDS[how >> 4 & 1], owner="here"))
            elif self.local:
                instance = self.local[how // 4 % len(self.local)]
                if how % 4 == 1:
                    instance.close()
                    self.local.remove(instance)
                elif instance.is_writer:
                    instance.mark_data_refreshed()
                    instance.write()
                    for _ in range(instance.msgq_size()):  # what is passed on may come back
                        self.pass_on(instance.msgq_pop())
                elif instance.MESSAGES:
                    instance.msgq_enqueue(next(iter(instance.MESSAGES.values()))())
        except BlackBoardError:
            pass

    def pass_on(self, message: Any) -> None:
        """Send a message on to a writer of the other interface, as a proxy does."""
        for reader in self.local:
            if not reader.is_writer and message.type in reader.MESSAGES:
                reader.msgq_enqueue(message.copy(), proxy=True)
                return

    # -- what must hold after each step

    def check(self) -> None:
        """Check that the server's books agree with each other and with the blackboard."""
        remote = [instance for session in self.sessions() for instance in session.instances.values()]
        readers = writers = 0
        for info in self.board.list_all():
            readers += info.num_readers
            writers += info.has_writer
        everybody = remote + self.local
        assert writers == sum(instance.is_writer for instance in everybody), "a stale writer, or two"
        assert readers == sum(not instance.is_writer for instance in everybody), "a stale reader"
        assert len(remote) == sum(
            len(membership.instances)
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
        """Check that what the server sends makes sense."""
        for route, frames in self.wire.sent.items():
            assert route[:1] == EVENTS_PREFIX
            for frame in frames:
                decode_server_frame(frame)
        self.wire.sent.clear()


WRITER, READER = 64, 0  # with the number of a type, and four times that of an id
_OPEN, _CLOSE, _WRITE, _SEND, _CREDIT, _DELIVERED, _ASK = (4 * kind for kind in range(1, 8))
_HELLO, _REPLACE = 2, 66
_RAW, _NUMBERED, _HERE, _WAIT = (3 + 4 * kind for kind in range(4))
_BOTH: Final = (_OPEN, 0, WRITER, _OPEN, 1, READER)
SCRIPTS: Final = tuple(
    bytes(script)
    for script in (
        (*_BOTH, _WRITE, 0, 0, 0, 2, _WRITE, 0, 0, 0, 2, _CREDIT, 1, 2),
        (*_BOTH, _WRITE, 0, 0, 0, 2, _WRITE, 0, 0, 0, 2, _WRITE, 0, 0, 0, 2, _OPEN, 1, READER, _CREDIT, 1, 9),
        (*_BOTH, _SEND, 1, 0, 0, 0, _DELIVERED, 0, 1, 0, 0),
        (*_BOTH, _SEND, 1, 0, 0, 0, _REPLACE, 16, _OPEN, 1, WRITER),
        (_OPEN, 0, WRITER, _OPEN, 1, WRITER, _CLOSE, 0, 0, _OPEN, 1, WRITER, _ASK, 1, 3),
        (_HERE, 0, 4, _OPEN, 1, READER, _SEND, 1, 0, 0, 0, _HERE, 0, 2, _WAIT, 0, 255),
        (
            _ASK,
            0,
            1,
            _OPEN,
            1,
            READER,
            _CLOSE,
            1,
            0,
            _ASK,
            1,
            4,
            _RAW,
            0,
            0,
            3,
            1,
            2,
            3,
            _NUMBERED,
            1,
            0,
            2,
            0xC1,
            2,
        ),
    )
)
"""One for each thing that can be done, to begin with."""


def zmq_sessions(data: bytes) -> None:
    """Let clients do what a script says; the server must stay sane, and at the end forget everything."""
    with patch.object(sessions, "raw_send", lambda wire: wire.send):  # which it is, but for real sockets
        fuzzed = Fuzzed()
        script = _Script(data)
        for client in range(_CLIENTS - 1):  # else each script had to begin like that
            fuzzed.say_hello(client, 0, replaces=False)
        for _ in range(_STEPS):
            if not script:
                break
            fuzzed.step(script)
            fuzzed.check()
        fuzzed.close()
