"""Messages from the server to writers in clients.

The sender of a message waits until the message is in the writer's queue, as on a local blackboard. So each
delivery ends with an outcome, which the client reports, or which follows from the end of the writer or of its
session, from too many pending messages or from a timeout. Only a sender in the server's thread does not wait.
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

# as many as wait in a writer's queue by default
MAX_PENDING_MESSAGES: Final = 1024
"""The maximum number of pending messages of a session."""

OutcomeCallback = Callable[[ResultCode, int], None]
"""Called with the outcome of a message, and with the limit of the queue for ``QUEUE_FULL``, else 0."""


@dataclass(slots=True)
class _Delivery:
    session: ZmqSession
    writer_serial: bytes
    on_outcome: OutcomeCallback
    deadline_s: float


class Deliveries:
    """The pending deliveries; for the server's thread only."""

    def __init__(self) -> None:
        self._numbers = itertools.count(1)
        self._pending: dict[int, _Delivery] = {}

    def __len__(self) -> int:
        return len(self._pending)

    def start(
        self, session: ZmqSession, frame: Deliver, on_outcome: OutcomeCallback, deadline_s: float
    ) -> None:
        """Send a message to the session of its writer.

        :param frame: the message, without delivery number.
        :param on_outcome: called exactly once.
        :param deadline_s: the time at which the delivery fails, in seconds of the monotonic clock.
        """
        if session.has_failed:
            on_outcome(ResultCode.NO_WRITER, 0)
            return
        if session.pending_count >= MAX_PENDING_MESSAGES:
            on_outcome(ResultCode.QUEUE_FULL, MAX_PENDING_MESSAGES)
            return
        frame.delivery = next(self._numbers)
        session.pending_count += 1
        self._pending[frame.delivery] = _Delivery(session, frame.instance, on_outcome, deadline_s)
        session.send(frame)

    def finish(self, session: ZmqSession, outcome: Delivered) -> None:
        """Finish a delivery with the outcome that the client reports, unless the delivery has expired."""
        delivery = self._pending.get(outcome.delivery)
        if delivery is not None and delivery.session is session:
            self._finish_delivery(outcome.delivery, outcome.code, outcome.detail)

    def fail_deliveries(self, session: ZmqSession, writer_serial: bytes | None = None) -> None:
        """Fail the deliveries to a session.

        :param writer_serial: the writer whose deliveries fail; None: all writers of the session.
        """
        for number, delivery in list(self._pending.items()):
            if delivery.session is session and writer_serial in (None, delivery.writer_serial):
                self._finish_delivery(number, ResultCode.NO_WRITER, 0)

    def expire(self, now_s: float) -> None:
        """Fail the deliveries whose deadline has passed."""
        for number, delivery in list(self._pending.items()):
            if delivery.deadline_s < now_s:
                self._finish_delivery(number, ResultCode.TIMEOUT, 0)

    def _finish_delivery(self, number: int, code: ResultCode, detail: int) -> None:
        delivery = self._pending.pop(number)
        delivery.session.pending_count -= 1
        delivery.on_outcome(code, detail)


class Forwarder(Listener):
    """Forwards messages of this process to a writer in a client.

    As a message listener, the forwarder sends a message and waits for the outcome in the thread of the
    sender, without a lock. Then the blackboard appends the message to the instance's `ForwardedQueue`, which
    reports the outcome to the sender.

    :param loop: the server's thread.
    :param deliver: sends a message; called in the server's thread.
    :param timeout_s: the seconds to wait for the outcome.
    :param log: called with the failures of messages whose sender does not wait for the outcome.
    """

    def __init__(
        self,
        loop: ServerLoop,
        deliver: Callable[[Interface, Message, OutcomeCallback], None],
        timeout_s: float,
        log: Callable[[str], None],
    ) -> None:
        self._loop = loop
        self._deliver = deliver
        self._timeout_s = timeout_s
        self._log = log
        # the outcome of the present message and its detail; by thread, because several threads may send
        self.outcome: Final = threading.local()

    def message_received(self, interface: Interface, message: Message) -> bool:
        if self._loop.is_current_thread():
            # the sender is a listener in the server's thread, which must not wait for a frame that it
            # receives
            self.outcome.value = (ResultCode.OK, 0)
            self._deliver(interface, message.copy(), self._log_failure)
            return True
        outcomes: SimpleQueue[tuple[ResultCode, int]] = SimpleQueue()

        def on_outcome(code: ResultCode, detail: int) -> None:
            outcomes.put((code, detail))

        self._loop.post(self._deliver, interface, message, on_outcome)
        self.outcome.value = (ResultCode.TIMEOUT, 0)
        with suppress(Empty):
            # a second longer than the deadline, which the server's thread checks only a few times a second
            self.outcome.value = outcomes.get(timeout=self._timeout_s + 1.0)
        return self.outcome.value[0] is not ResultCode.DECLINED

    def _log_failure(self, code: ResultCode, detail: int) -> None:  # noqa: ARG002 - a callback's signature
        if code not in (ResultCode.OK, ResultCode.DECLINED):
            self._log(f"a message of a listener was not delivered: {code.name}")


class ForwardedQueue(MessageQueue):
    """The queue of a writer in a client, which stores no messages and raises the error of the outcome."""

    __slots__ = ("_forwarder",)

    def __init__(self, uid: str, forwarder: Forwarder) -> None:
        super().__init__(uid)
        self._forwarder = forwarder

    def enqueue(self, message: Message, time_us: int) -> None:
        """Report the outcome of the present message, which the `Forwarder` has sent, to its sender.

        :raises NoWriterError: if the writer or its session ended before the reply.
        :raises QueueFullError: if the writer's queue is full, or its session has too many pending messages.
        :raises RequestTimeoutError: if the client did not reply in time.
        :raises BlackBoardError: if the client refuses the message for another reason.
        """
        code, detail = self._forwarder.outcome.value
        if code is not ResultCode.OK:
            raise_refusal(Reply(code, detail, request=0), uid=self._uid, message_type=message.type)
        message.mark_enqueued(time_us)
