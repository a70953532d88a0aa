"""The base class of servers, with the serving thread and its wake-up, and the limits of their clients."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Iterable
from types import TracebackType
from typing import Final, Self

from cxbridge.blackboard.kit.complaints import Complaints
from cxbridge.blackboard.kit.errors import RemoteRefusalError
from cxbridge.blackboard.kit.wakeup import SocketWakeup
from cxbridge.events import Logger
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.schema import InterfaceSchema

# each instance takes memory besides its block, which may be small
MAX_INSTANCES: Final = 4096
"""The maximum number of open instances of a client."""

# the server's memory holds a copy of the data block of each open instance
MAX_BLOCK_BYTES: Final = 16 * 1024 * 1024
"""The maximum total size of the blocks of a client's instances, in bytes."""


def check_client_limits(instances: Iterable[Interface], schema: InterfaceSchema) -> None:
    """Check that a client may open one more instance.

    :param instances: the client's open instances.
    :param schema: the type of the instance to be opened.
    :raises RemoteRefusalError: if the client would exceed the limits.
    """
    block_sizes = [instance.SCHEMA.datasize for instance in instances]
    if len(block_sizes) >= MAX_INSTANCES:
        raise RemoteRefusalError(f"a client may have at most {MAX_INSTANCES} interfaces open")
    if sum(block_sizes) + schema.datasize > MAX_BLOCK_BYTES:
        raise RemoteRefusalError(
            f"the interfaces of a client may have at most {MAX_BLOCK_BYTES} bytes in total"
        )


class BoardServer(ABC):
    """Serves a blackboard in one thread from `start` to `stop`.

    The server of each transport implements the abstract methods, and polls `_wakeup`, which :meth:`stop` sets
    to interrupt the poll.
    """

    def __init__(self, thread_name: str, log: Logger | None) -> None:
        self._log: Final = log
        self._complaints: Final = Complaints(self._warn)
        self._is_stopping = False
        self._is_started = False
        self._is_released = False
        self._thread_id = 0  # the identifier of the serving thread, set by that thread before it serves
        self._thread = threading.Thread(target=self._serve_thread, name=thread_name, daemon=True)

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.stop()

    def start(self) -> None:
        """Start the serving thread.

        :raises BlackBoardError: if the server cannot listen.
        """
        assert not self._is_started, "a server can be started only once"
        self._is_started = True
        self._wakeup = SocketWakeup()
        try:
            self._prepare()
        except BaseException:
            self._release_once()
            raise
        self._thread.start()

    def stop(self, timeout: float | None = None) -> None:
        """End the sessions, close the instances of their clients and release the resources.

        Further calls have no effect, except after a timeout: then the resources are not released yet.

        :param timeout: the seconds to wait for the thread; None: no limit.
        """
        self._is_stopping = True
        if self._is_started:
            self._wakeup.set()
        if self._thread.ident is not None:
            self._thread.join(timeout)
        # a thread that is still busy would use the released sockets
        if not self._thread.is_alive():
            self._release_once()

    def is_current_thread(self) -> bool:
        """Return whether the caller runs in the serving thread."""
        return threading.get_ident() == self._thread_id

    def _serve_thread(self) -> None:
        self._thread_id = threading.get_ident()
        self._run()

    def _release_once(self) -> None:
        if not self._is_released:
            self._is_released = True
            self._release()
            if self._is_started:
                self._wakeup.close()

    @abstractmethod
    def _prepare(self) -> None:
        """Acquire sockets and other resources; called in the thread that starts the server."""

    @abstractmethod
    def _run(self) -> None:
        """Serve until the server is stopped; called in the serving thread."""

    @abstractmethod
    def _release(self) -> None:
        """Release the server's resources; called in the thread that stops it, or that could not start it."""

    def _warn(self, text: str) -> None:
        if self._log is not None:
            self._log.warn(text)
