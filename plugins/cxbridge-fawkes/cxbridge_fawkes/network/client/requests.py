"""Requests to Fawkes with a reply: one at a time, because replies have no number.

The client could not distinguish a late reply from the reply to the next request. So a timeout ends the
connection, and the client reconnects.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Final

from cxbridge.blackboard.errors import BlackBoardGoneError
from cxbridge_fawkes.network.client.connection import FawkesConnection
from cxbridge_fawkes.network.errors import ConnectionLostError
from cxbridge_fawkes.network.messages.blackboard import (
    ID_SIZE,
    TYPE_SIZE,
    InterfaceList,
    ListAll,
    ListMatching,
    Open,
    OpenFailure,
    OpenSuccess,
)

AWAY_REASON: Final = "it has not come back yet"
"""The reason in the error of a call that has no connection."""

EMPTY_LIST_REQUEST: Final = ListMatching("", "")
"""The cheapest request with a reply: no interface has an empty name, so the list is empty."""

Reply = InterfaceList | OpenSuccess | OpenFailure


@dataclass(slots=True)
class _PendingRequest:
    """A request that waits for its reply."""

    reply_types: tuple[type[Reply], ...]
    on_reply: Callable[[Reply], None] | None
    reply: Future[Reply] = field(default_factory=Future)


class RequestSender:
    """Sends requests over the present connection and waits for their replies.

    :param address: the server's address, for errors.
    :param timeout: the seconds to wait for a connection, and then for a reply.
    """

    def __init__(self, address: str, timeout: float) -> None:
        self.address: Final = address
        self._timeout: Final = timeout
        self._request_lock = threading.Lock()
        self._state_changed = threading.Condition()
        self.connection: FawkesConnection | None = None
        """The present connection; None after its loss."""
        self.must_confirm = False
        """Whether a shutdown must wait until the server has received the sent messages."""
        self._pending: _PendingRequest | None = None
        self._is_shut_down = False

    def use_connection(self, connection: FawkesConnection) -> None:
        """Send further frames over a new connection."""
        with self._state_changed:
            self.connection = connection
            self._state_changed.notify_all()

    def drop_connection(self, reason: str) -> None:
        """Drop the connection; a waiting request fails."""
        with self._state_changed:
            self.connection = None
            request, self._pending = self._pending, None
        if request is not None:
            request.reply.set_exception(ConnectionLostError(self.address, reason))

    def shut_down(self) -> None:
        """Refuse all further requests."""
        with self._state_changed:
            self._is_shut_down = True
            self._state_changed.notify_all()
        self.drop_connection("the blackboard was shut down")

    def make_unavailable_error(self) -> ConnectionLostError:
        """Return the error of a call without connection."""
        return ConnectionLostError(self.address, AWAY_REASON)

    def send(self, frames: bytes, *, must_arrive: bool = False) -> None:
        """Send complete frames that get no reply.

        :param must_arrive: whether a shutdown must wait until the server has received the frames.
        :raises ConnectionLostError: if there is no connection, or the connection is lost.
        """
        connection = self.connection
        if connection is None:
            raise self.make_unavailable_error()
        self.must_confirm |= must_arrive
        connection.send(frames)

    def request(
        self,
        message: Open | ListAll | ListMatching,
        on_reply: Callable[[Reply], None] | None = None,
        *,
        timeout: float | None = None,
        extend_on_data: bool = False,
    ) -> Reply:
        """Send a request and return its reply.

        :param on_reply: called with the reply in the receiving thread, before the next frame is handled.
        :param timeout: the limit in seconds; by default the timeout of this object.
        :param extend_on_data: whether any received data extend the wait, and the request fails at once
            without a connection.
        :raises ConnectionLostError: if the connection is missing for too long or lost during the request, or
            if no reply arrives in time.
        :raises BlackBoardGoneError: after the shutdown.
        """
        reply_types = (OpenSuccess, OpenFailure) if isinstance(message, Open) else (InterfaceList,)
        request = _PendingRequest(reply_types, on_reply)
        timeout = self._timeout if timeout is None else timeout
        with self._request_lock:
            connection = self._register_request(request, 0.0 if extend_on_data else timeout)
            connection.send(message.to_bytes())
            wait_s = timeout  # with `extend_on_data`, from the last received data
            while wait_s > 0:
                with suppress(TimeoutError):
                    return request.reply.result(wait_s)
                wait_s = connection.last_received_s + timeout - time.monotonic() if extend_on_data else 0.0
            reason = f"no reply within {timeout:g} s"
            connection.abort(reason)  # a late reply would be taken for the reply to the next request
        raise ConnectionLostError(self.address, reason)

    def list(self, type_glob: str, id_glob: str) -> InterfaceList:
        """Request the matching interfaces; all interfaces if the patterns do not fit into the message.

        :raises ConnectionLostError: if there is no reply.
        :raises BlackBoardGoneError: after the shutdown.
        """
        are_short = len(type_glob.encode()) < TYPE_SIZE and len(id_glob.encode()) < ID_SIZE
        requests_all = (type_glob, id_glob) == ("*", "*") or not are_short
        reply = self.request(ListAll() if requests_all else ListMatching(type_glob, id_glob))
        assert isinstance(reply, InterfaceList)
        return reply

    def handle_reply(self, reply: Reply) -> bool:
        """Handle a reply in the receiving thread; return whether a request was waiting for the reply."""
        with self._state_changed:
            request = self._pending
            if request is None or not isinstance(reply, request.reply_types):
                return False
            self._pending = None
        try:
            if request.on_reply is not None:
                request.on_reply(reply)
        finally:
            request.reply.set_result(reply)
        return True

    def _register_request(self, request: _PendingRequest, timeout: float) -> FawkesConnection:
        """Wait for a connection, and let the request wait for its reply; return the connection.

        :raises ConnectionLostError: if there is no connection within the timeout.
        :raises BlackBoardGoneError: after the shutdown.
        """
        deadline_s = time.monotonic() + timeout
        with self._state_changed:
            while self.connection is None and not self._is_shut_down:
                if not self._state_changed.wait(deadline_s - time.monotonic()):
                    raise self.make_unavailable_error()
            if self._is_shut_down or self.connection is None:
                raise BlackBoardGoneError
            # before sending: the reply may arrive before the call of send returns
            self._pending = request
            return self.connection
