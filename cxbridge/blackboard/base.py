"""The base of all blackboards, in this process or at the other end of a wire."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import ClassVar, Final, NoReturn, Protocol, Self, TypeVar, overload
from uuid import UUID

from msgspec import Struct

from cxbridge.blackboard.errors import BlackBoardError, NoWriterError, UnknownTypeError
from cxbridge.blackboard.info import InterfaceInfo
from cxbridge.blackboard.listeners import (
    EventKind,
    Listen,
    Listener,
    ListenerTable,
    Observer,
    ObserverTable,
    listening,
)
from cxbridge.blackboard.names import check_names
from cxbridge.clock import Clock
from cxbridge.errors import InterfaceDefinitionError, InterfaceError
from cxbridge.events import EventBus
from cxbridge.interfaces.instance import Interface, Message
from cxbridge.interfaces.message import Port


class ListenedPort(Port[Interface], Protocol):
    """The port of an interface that has listeners."""

    @property
    def listeners(self) -> ListenerTable:
        """The listeners of the interface."""


class OpenRequest(Struct, frozen=True):
    """An interface to open; its names are checked.

    :param owner: the name of the opener, for lists and messages to people.
    :param queue_limit: how many messages may wait, of a writer; None: 1,024.
    :param listen: called with the instance before any other code can see it.
    """

    interface_class: type[Interface]
    id: str
    owner: str = ""
    writer: bool = False
    queue_limit: int | None = None
    listen: Listen | None = None

    @property
    def type(self) -> str:
        """The type of the interface."""
        return self.interface_class.SCHEMA.name

    @property
    def uid(self) -> str:
        """``Type::id``."""
        return f"{self.type}::{self.id}"

    @property
    def key(self) -> tuple[str, str]:
        """Type and id."""
        return self.type, self.id

    def make_instance(self, port: ListenedPort, serial: UUID) -> Interface:
        """Make the instance, with the listeners it is to have from the beginning."""
        instance = self.interface_class(
            port,
            id=self.id,
            owner=self.owner,
            serial=serial,
            writer=self.writer,
            queue_limit=self.queue_limit,
        )
        if self.listen is not None:
            self.listen(instance, port.listeners)
        return instance


I = TypeVar("I", bound=Interface)  # noqa: E741 - I for interface

COMPONENT: Final = "BlackBoard"
"""Under which blackboards log."""


class Registry(Protocol):
    """Where the class of an interface type comes from: :class:`cxbridge.interfaces.InterfaceRegistry`."""

    def get(self, name: str) -> type[Interface]:
        """Return the class of the type ``name``.

        :raises InterfaceError: when there is none.
        """


class BlackBoard(ABC):
    """Interfaces to open, to list and to watch; a transport derives from it.

    As a context manager it is shut down at the end.

    :cvar reports_writes: whether its bus gets every write of the interfaces that are open here. Where it
        does not, listeners do: each reads the block of its very write.

    :param registry: gives the classes of types that are named by a string.
    :param clock: gives time stamps.
    :param bus: gets log lines and writes; None: failing listeners are reported to :mod:`logging`.
    """

    reports_writes: ClassVar[bool] = True

    def __init__(self, registry: Registry, clock: Clock, bus: EventBus | None = None) -> None:
        self.registry: Final = registry
        self.clock: Final = clock
        self.bus: Final = bus
        self._log = None if bus is None else bus.logger(COMPONENT)
        self._observers = ObserverTable(self.report_fault)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.shutdown()

    # -- opening and closing

    @overload
    def open_for_reading(
        self, interface: type[I], interface_id: str, *, owner: str = "", listen: Listen | None = None
    ) -> I: ...
    @overload
    def open_for_reading(
        self, interface: str, interface_id: str, *, owner: str = "", listen: Listen | None = None
    ) -> Interface: ...
    def open_for_reading(
        self,
        interface: type[Interface] | str,
        interface_id: str,
        *,
        owner: str = "",
        listen: Listen | None = None,
    ) -> Interface:
        """Open an interface for reading; it need not exist yet.

        :param interface: the class, or the name of its type.
        :param owner: who opens it, for lists and messages to people.
        :param listen: registers a listener before anything can happen to the instance; see :func:`listening`.
        :raises InvalidNameError: when the type or the id is empty or too long.
        :raises UnknownTypeError: when there is no such type.
        :raises InterfaceDefinitionError: when its definition is wrong.
        :raises VersionMismatchError: when it is open in another version of the type.
        """
        interface_class = self._resolve(interface, interface_id)
        return self._open(OpenRequest(interface_class, interface_id, owner, listen=listen))

    @overload
    def open_for_writing(
        self,
        interface: type[I],
        interface_id: str,
        *,
        owner: str = "",
        queue_limit: int | None = None,
        listen: Listen | None = None,
    ) -> I: ...
    @overload
    def open_for_writing(
        self,
        interface: str,
        interface_id: str,
        *,
        owner: str = "",
        queue_limit: int | None = None,
        listen: Listen | None = None,
    ) -> Interface: ...
    def open_for_writing(
        self,
        interface: type[Interface] | str,
        interface_id: str,
        *,
        owner: str = "",
        queue_limit: int | None = None,
        listen: Listen | None = None,
    ) -> Interface:
        """Open an interface for writing.

        Its private copy is all zero: call read() to start with the present data.

        :param interface: the class, or the name of its type.
        :param owner: who opens it, for lists and messages to people.
        :param queue_limit: how many messages may wait; None: 1,024.
        :param listen: registers a listener before anything can happen to the instance; see :func:`listening`.
        :raises WriterActiveError: when it has a writer already.
        :raises InvalidNameError: when the type or the id is empty or too long.
        :raises UnknownTypeError: when there is no such type.
        :raises VersionMismatchError: when it is open in another version of the type.
        """
        interface_class = self._resolve(interface, interface_id)
        return self._open(OpenRequest(interface_class, interface_id, owner, True, queue_limit, listen))

    def open_multiple_for_reading(
        self, type_glob: str, id_glob: str = "*", *, owner: str = ""
    ) -> Sequence[Interface]:
        """Open all interfaces for reading that exist and match, as :meth:`list` finds them; all or none.

        :raises BlackBoardError: when one of them cannot be opened.
        """
        opened: list[Interface] = []
        try:
            for info in self.list(type_glob, id_glob):
                opened.append(self.open_for_reading(info.type, info.id, owner=owner))  # noqa: PERF401 - see except
        except BlackBoardError:
            for instance in opened:
                self.close(instance)
            raise
        return opened

    def _resolve(self, interface: type[Interface] | str, interface_id: str) -> type[Interface]:
        """Return the class to open, after the names have been checked."""
        check_names(interface if isinstance(interface, str) else interface.SCHEMA.name, interface_id)
        if not isinstance(interface, str):
            return interface
        try:
            return self.registry.get(interface)
        except InterfaceDefinitionError:
            raise  # there is such a type, and its file is wrong
        except InterfaceError as error:
            raise UnknownTypeError(interface, hint=error.hint) from error

    @abstractmethod
    def _open(self, request: OpenRequest) -> Interface:
        """Open an interface."""

    @abstractmethod
    def close(self, instance: Interface) -> None:
        """Close an instance that was opened here; it is invalid afterwards. Closing twice is not an error.

        The interface vanishes with its last instance. While a reader exists its data outlive the writer.

        :raises ForeignInstanceError: when it was opened on another blackboard.
        """

    @abstractmethod
    def shutdown(self) -> None:
        """Make all instances invalid and refuse to open more. No event is delivered."""

    # -- looking around

    @abstractmethod
    def list(self, type_glob: str = "*", id_glob: str = "*") -> Sequence[InterfaceInfo]:
        """Return a description of the interfaces that match, the oldest first.

        :param type_glob: shell pattern for the type: ``*``, ``?``, ``[seq]``, ``[!seq]``.
        :param id_glob: shell pattern for the id.
        """

    def list_all(self) -> Sequence[InterfaceInfo]:
        """Return a description of all interfaces, the oldest first."""
        return self.list()

    # -- the connection, where there is one

    @property
    def connected(self) -> bool:
        """Whether the interfaces can be reached now; always, where there is no connection to lose."""
        return True

    def on_connection(self, callback: Callable[[bool], None]) -> None:  # noqa: B027 - optional
        """Call ``callback`` with False when the connection is lost, with True when all is open again.

        In the thread of the listeners. Never, where there is no connection to lose.
        """

    @property
    def skipped(self) -> int:
        """The number of updates that a newer one replaced before delivery, as far as known here."""
        return 0

    def flush(self, timeout: float | None = None) -> None:  # noqa: B027 - optional
        """Return when everything done here has arrived, and listeners were called for what arrived before.

        :param timeout: seconds; None: what requests may take.
        :raises BlackBoardError: when it takes too long.
        """

    # -- notifications

    def register_listener(self, listener: Listener, instance: Interface, *kinds: EventKind) -> None:
        """Notify ``listener`` of what happens on the interface of ``instance``, until that is closed.

        :param kinds: of which events; without any, of those whose methods ``listener`` overrides (not of
            messages when the instance is not a writer).
        :raises ForeignInstanceError: when the instance is not open on this blackboard.
        :raises BlackBoardError: when ``kinds`` has messages and the instance is not a writer.
        """
        listening(listener, *kinds)(instance, self._listeners_of(instance))

    def unregister_listener(self, listener: Listener, instance: Interface) -> None:
        """Stop notifying ``listener`` on behalf of ``instance``.

        No error when it was not registered, or when the instance is closed.
        """
        if instance.valid:
            self._listeners_of(instance).unregister(listener, instance)

    @abstractmethod
    def _listeners_of(self, instance: Interface) -> ListenerTable:
        """Return the listeners of the instance's interface.

        :raises ForeignInstanceError: when the instance is not open on this blackboard.
        """

    def register_observer(self, observer: Observer, type_glob: str = "*", id_glob: str = "*") -> None:
        """Notify ``observer`` of interfaces that come into being or vanish and match both patterns."""
        self._observers.register(observer, type_glob, id_glob)

    def unregister_observer(self, observer: Observer) -> None:
        """Stop notifying ``observer``; no error when it was not registered."""
        self._observers.unregister(observer)

    # -- for ports, and for the log

    def refuse_message(self, sender: Interface, message: Message) -> NoReturn:
        """Log that a message has no writer, in the words of Fawkes.

        :raises NoWriterError: always.
        """
        self.warn(
            f"Cannot transmit message from sender {message.sender_thread_name} via interface {sender.id} "
            f"(type {sender.type}), no writing instance exists!"
        )
        raise NoWriterError(sender.uid)

    def report_fault(self, operation: str, error: Exception) -> None:
        """Report a listener that failed."""
        if self._log is None:
            import logging  # noqa: PLC0415 - rarely needed, and not quickly imported

            logging.getLogger(__name__).error("%s failed", operation, exc_info=error)
        else:
            self._log.error(f"{operation} failed: {type(error).__name__}: {error}")

    def warn(self, text: str) -> None:
        """Log a warning."""
        if self._log is not None:
            self._log.warn(text)
