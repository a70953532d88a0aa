"""Messages from the server to writers in clients, which report the outcome of each.

The sender of a message waits until the message is in the writer's queue, as on a local blackboard. So each
delivery ends with an outcome: that of the client, the loss of the session, or a timeout.
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Final

from cxbridge.blackboard.listeners import Listener
from cxbridge.blackboard.zmq.server.channels import ServerLoop
from cxbridge.blackboard.zmq.server.sessions import ZmqSession
from cxbridge.blackboard.zmq.wire.frames import Deliver, Delivered, Reply, ResultCode
from cxbridge.blackboard.zmq.wire.refusals import raise_refusal
from cxbridge.interfaces.instance import Interface, Message, MessageQueue

# as many as a writer's queue holds by default
MAX_PENDING: Final = 1024
"""The maximal number of pending messages per session."""

OutcomeCallback = Callable[[ResultCode, int], None]
"""Takes the outcome of a message and a detail."""


@dataclass(slots=True)
class _Delivery:
    session: ZmqSession
    instance: bytes
    done: OutcomeCallback
    deadline: float


class Deliveries:
    """The pending messages; for the server's thread only."""

    def __init__(self) -> None:
        self._numbers = itertools.count(1)
        self._pending: dict[int, _Delivery] = {}

    def __len__(self) -> int:
        return len(self._pending)

    def start(self, session: ZmqSession, message: Deliver, done: OutcomeCallback, deadline: float) -> None:
        """Send a message to the session of its writer.

        :param message: a frame without delivery number.
        :param done: called exactly once with the outcome.
        :param deadline: the limit, in seconds of the monotonic clock.
        """
        if session.failed:
            done(ResultCode.NO_WRITER, 0)
            return
        if session.pending >= MAX_PENDING:
            done(ResultCode.QUEUE_FULL, MAX_PENDING)
            return
        message.delivery = next(self._numbers)
        session.pending += 1
        self._pending[message.delivery] = _Delivery(session, message.instance, done, deadline)
        session.send(message)

    def finish(self, session: ZmqSession, outcome: Delivered) -> None:
        """Finish a delivery with the outcome that the client reports; expired deliveries are ignored."""
        delivery = self._pending.get(outcome.delivery)
        if delivery is not None and delivery.session is session:
            self._finish_delivery(outcome.delivery, outcome.code, outcome.detail)

    def drop(self, session: ZmqSession, instance: bytes | None = None) -> None:
        """Fail the deliveries to a session, or to one of its writers."""
        for number, delivery in list(self._pending.items()):
            if delivery.session is session and instance in (None, delivery.instance):
                self._finish_delivery(number, ResultCode.NO_WRITER, 0)

    def expire(self, now: float) -> None:
        """Fail the deliveries whose deadline has passed."""
        for number, delivery in list(self._pending.items()):
            if delivery.deadline < now:
                self._finish_delivery(number, ResultCode.TIMEOUT, 0)

    def _finish_delivery(self, number: int, code: ResultCode, detail: int) -> None:
        delivery = self._pending.pop(number)
        delivery.session.pending -= 1
        delivery.done(code, detail)


class Forwarder(Listener):
    """Forwards messages of this process to a writer in a client.

    The message listener sends and waits in the thread of the sender, without a lock. Then the
    `ForwardedQueue` of the instance reports the outcome.

    :param loop: the server's thread.
    :param deliver: sends a message from the server's thread.
    :param timeout: seconds to wait for the outcome.
    :param log: called with the failures of messages whose sender does not wait for the outcome.
    """

    def __init__(
        self,
        loop: ServerLoop,
        deliver: Callable[[Interface, Message, OutcomeCallback], None],
        timeout: float,
        log: Callable[[str], None],
    ) -> None:
        self._loop = loop
        self._deliver = deliver
        self._timeout = timeout
        self._log = log
        self.outcome: Final = threading.local()

    def message_received(self, interface: Interface, message: Message) -> bool:
        if self._loop.is_current_thread():
            # a listener of a remote write: to wait for the outcome would stop the thread that receives it
            self.outcome.value = (ResultCode.OK, 0)
            self._deliver(interface, message.copy(), self._log_failure)
            return True
        outcomes: SimpleQueue[tuple[ResultCode, int]] = SimpleQueue()

        def done(code: ResultCode, detail: int) -> None:
            outcomes.put((code, detail))

        self._loop.post(self._deliver, interface, message, done)
        self.outcome.value = (ResultCode.TIMEOUT, 0)
        with suppress(Empty):
            # longer than a delivery may take, because the server's thread checks deadlines only now and then
            self.outcome.value = outcomes.get(timeout=self._timeout + 1.0)
        return self.outcome.value[0] is not ResultCode.DECLINED

    def _log_failure(self, code: ResultCode, detail: int) -> None:  # noqa: ARG002 - a callback's signature
        if code not in (ResultCode.OK, ResultCode.DECLINED):
            self._log(f"a message of a listener was not delivered: {code.name}")


class ForwardedQueue(MessageQueue):
    """The queue of a writer in a client: it stores nothing and raises the error of the outcome."""

    __slots__ = ("_forwarder",)

    def __init__(self, uid: str, forwarder: Forwarder) -> None:
        super().__init__(uid)
        self._forwarder = forwarder

    def append(self, message: Message, time_us: int) -> None:
        """Finish the sending of a message.

        :raises NoWriterError: if the writer was closed before its reply.
        :raises QueueFullError: if the writer's queue is bounded and full.
        :raises RequestTimeoutError: if the client did not reply.
        """
        code, detail = self._forwarder.outcome.value
        if code is not ResultCode.OK:
            raise_refusal(Reply(code, detail, request=0), uid=self._uid, message_type=message.type)
        message.mark_enqueued(time_us)
