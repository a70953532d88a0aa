"""Blackboards of every transport, as the state machine wants them: to be served, killed and restarted."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

from cxbridge.blackboard import BlackBoard, LocalBlackBoard
from cxbridge.clock import VirtualClock
from tests.blackboard.samples import SampleRegistry


class Site(ABC):
    """A blackboard, and programs that come to it over a transport.

    :param window: of a transport that has one: updates that may be under way to a client.
    """

    acknowledges: ClassVar[bool] = True
    """Whether a message that was sent is in the writer's queue when the sender goes on."""
    restarts: ClassVar[bool] = True
    keeps: ClassVar[bool] = True
    """Whether readers keep the last value when the server has come back without it, until somebody writes."""
    exact: ClassVar[bool] = True
    """Whether a listener reads the very write that it is notified of, though newer ones have come."""
    board: LocalBlackBoard
    """The one that is served."""

    def __init__(self, window: int) -> None:
        self.window = window
        self.clock = VirtualClock()
        self.clients: list[Any] = []

    @abstractmethod
    def connect(self, name: str) -> BlackBoard:
        """Return another program's way to the blackboard."""

    @abstractmethod
    def settle(self) -> None:
        """Return when whatever a client has done has arrived at all others."""

    @abstractmethod
    def kill(self, client: Any) -> None:
        """End a client as SIGKILL does: without a goodbye."""

    @abstractmethod
    def wait_reaped(self) -> None:
        """Return when the server knows of all that were killed."""

    @abstractmethod
    def stop(self) -> None:
        """Stop the server; its blackboard and all that was in it are lost."""

    @abstractmethod
    def start(self) -> None:
        """Serve an empty blackboard at the same address; return when the clients are there again."""

    @abstractmethod
    def close(self) -> None:
        """Give everything back."""

    @contextmanager
    def not_reading(self, client: Any) -> Iterator[None]:
        """Let a client take nothing from its connection."""
        del client
        yield

    def skipped(self, client: Any) -> int:
        """Return how many updates a client knows to have missed."""
        del client
        return 0


class LocalSite(Site):
    """The programs are parts of one process."""

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
