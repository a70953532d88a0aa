"""Blackboards of all transports for the state machine, which starts, kills and restarts them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

from cxbridge.blackboard import BlackBoard, LocalBlackBoard
from cxbridge.clock import VirtualClock
from tests.blackboard.samples import SampleRegistry


class Site(ABC):
    """A blackboard and its programs over a transport.

    :param window: the maximum number of unacknowledged updates of a client, for transports with such a limit.
    """

    acknowledges: ClassVar[bool] = True
    """Whether a sender waits until its message is in the writer's queue."""
    restarts: ClassVar[bool] = True
    keeps: ClassVar[bool] = True
    """Whether readers keep the last value after a restart of the server, until the next write."""
    exact: ClassVar[bool] = True
    """Whether a listener reads the data of the write in its notification, even after newer writes."""
    board: LocalBlackBoard
    """The blackboard of the server's process."""

    def __init__(self, window: int) -> None:
        self.window = window
        self.clock = VirtualClock()
        self.clients: list[Any] = []

    @abstractmethod
    def connect(self, name: str) -> BlackBoard:
        """Return the blackboard of another program."""

    @abstractmethod
    def settle(self) -> None:
        """Wait until the effects of all clients have arrived at all clients."""

    @abstractmethod
    def kill(self, client: Any) -> None:
        """End a client without Bye, as SIGKILL does."""

    @abstractmethod
    def wait_reaped(self) -> None:
        """Wait until the server has ended the sessions of killed clients."""

    @abstractmethod
    def stop(self) -> None:
        """Stop the server and lose its blackboard."""

    @abstractmethod
    def start(self) -> None:
        """Serve an empty blackboard at the same address, and wait until the clients are connected."""

    @abstractmethod
    def close(self) -> None:
        """Close the clients and the server."""

    @contextmanager
    def not_reading(self, client: Any) -> Iterator[None]:
        """Stop a client's receiving."""
        del client
        yield

    def skipped(self, client: Any) -> int:
        """Return the number of updates that a client knows as skipped."""
        del client
        return 0


class LocalSite(Site):
    """Programs in a single process."""

    restarts = False

    def __init__(self, window: int) -> None:
        super().__init__(window)
        self.board = LocalBlackBoard(SampleRegistry(), self.clock)

    def connect(self, name: str) -> BlackBoard:
        del name
        return self.board

    def settle(self) -> None:
        pass

    def kill(self, client: Any) -> None:
        raise NotImplementedError

    def wait_reaped(self) -> None:
        pass

    def stop(self) -> None:
        raise NotImplementedError

    def start(self) -> None:
        raise NotImplementedError

    def close(self) -> None:
        self.board.shutdown()
