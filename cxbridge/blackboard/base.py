"""The base class of local and remote blackboards.

A blackboard holds interfaces, which are typed blocks of data named by type and id. Each interface has at most
one writer and any number of readers, and readers send messages to the writer. :class:`BlackBoard` checks
names, finds the classes of types, and keeps the observers; the subclass of each transport opens, closes and
lists interfaces.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import ClassVar, Final, NoReturn, Protocol, Self, TypeVar, overload
from uuid import UUID

from msgspec import Struct

from cxbridge.blackboard.errors import NoWriterError, UnknownTypeError
from cxbridge.blackboard.info import InterfaceInfo
from cxbridge.blackboard.listeners import (
    EventKind,
    Listener,
    ListenerRegistrar,
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
    """A port that also has the table of its interface's listeners."""

    @property
    def listeners(self) -> ListenerTable: ...


class OpenRequest(Struct, frozen=True):
    """A request to open an interface, with checked names.

    :param owner: the opener's name, for lists and log lines.
    :param queue_limit: the maximum number of a writer's queued messages; None: 1,024.
    :param listen: called with the instance before other code can access the instance.
    """

    interface_class: type[Interface]
    id: str
    owner: str = ""
    is_writer: bool = False
    queue_limit: int | None = None
    listen: ListenerRegistrar | None = None

    @property
    def type(self) -> str:
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
        """Make the instance, and register the listeners of the request."""
        instance = self.interface_class(
            port,
            id=self.id,
            owner=self.owner,
            serial=serial,
            writer=self.is_writer,
            queue_limit=self.queue_limit,
        )
        if self.listen is not None:
            self.listen(instance, port.listeners)
        return instance


InterfaceT = TypeVar("InterfaceT", bound=Interface)

COMPONENT: Final = "BlackBoard"
"""The component of a blackboard's log lines."""


class Registry(Protocol):
    """A source of interface classes, such as :class:`cxbridge.interfaces.InterfaceRegistry`."""

    def get(self, name: str) -> type[Interface]:
        """Return the class of an interface type.

        :raises InterfaceError: if the type is unknown.
        """


class BlackBoard(ABC):
    """Opens, lists and watches interfaces. As a context manager, it shuts down at the end of the block.

    :cvar reports_writes: whether the blackboard emits every write of the open interfaces on the bus; if not,
        a recorder must register listeners, which read the block of each write.
    :param registry: returns the classes of types that are named by a string.
    :param clock: the source of time stamps.
    :param bus: gets log lines and writes; without a bus, errors of listeners go to :mod:`logging`.
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

    @overload
    def open_for_reading(
        self,
        interface: type[InterfaceT],
        interface_id: str,
        *,
        owner: str = "",
        listen: ListenerRegistrar | None = None,
    ) -> InterfaceT: ...
    @overload
    def open_for_reading(
        self, interface: str, interface_id: str, *, owner: str = "", listen: ListenerRegistrar | None = None
    ) -> Interface: ...
    def open_for_reading(
        self,
        interface: type[Interface] | str,
        interface_id: str,
        *,
        owner: str = "",
        listen: ListenerRegistrar | None = None,
    ) -> Interface:
        """Open an interface for reading; the interface need not exist yet.

        :param interface: the class or the type's name.
        :param owner: the opener's name, for lists and log lines.
        :param listen: registers a listener before any event of the instance, see :func:`listening`.
        :raises InvalidNameError: if the type or the id is empty or too long, or the id contains NUL.
        :raises UnknownTypeError: if the type is unknown.
        :raises InterfaceDefinitionError: if the definition is wrong.
        :raises VersionMismatchError: if the interface is open in another version of the type.
        :raises BlackBoardGoneError: after the shutdown.
        :raises BlackBoardError: if a remote blackboard does not reply, or refuses for another reason.
        """
        interface_class = self._find_class(interface, interface_id)
        return self._open(OpenRequest(interface_class, interface_id, owner, listen=listen))

    @overload
    def open_for_writing(
        self,
        interface: type[InterfaceT],
        interface_id: str,
        *,
        owner: str = "",
        queue_limit: int | None = None,
        listen: ListenerRegistrar | None = None,
    ) -> InterfaceT: ...
    @overload
    def open_for_writing(
        self,
        interface: str,
        interface_id: str,
        *,
        owner: str = "",
        queue_limit: int | None = None,
        listen: ListenerRegistrar | None = None,
    ) -> Interface: ...
    def open_for_writing(
        self,
        interface: type[Interface] | str,
        interface_id: str,
        *,
        owner: str = "",
        queue_limit: int | None = None,
        listen: ListenerRegistrar | None = None,
    ) -> Interface:
        """Open an interface for writing.

        The instance's copy is zero-filled; :meth:`Interface.read` loads the present data.

        :param interface: the class or the type's name.
        :param owner: the opener's name, for lists and log lines.
        :param queue_limit: the maximum number of queued messages, by default 1,024.
        :param listen: registers a listener before any event of the instance, see :func:`listening`.
        :raises WriterActiveError: if the interface has a writer.
        :raises InvalidNameError: if the type or the id is empty or too long, or the id contains NUL.
        :raises UnknownTypeError: if the type is unknown.
        :raises InterfaceDefinitionError: if the definition is wrong.
        :raises VersionMismatchError: if the interface is open in another version of the type.
        :raises BlackBoardGoneError: after the shutdown.
        :raises BlackBoardError: if a remote blackboard does not reply, or refuses for another reason.
        """
        interface_class = self._find_class(interface, interface_id)
        return self._open(
            OpenRequest(
                interface_class,
                interface_id,
                owner,
                is_writer=True,
                queue_limit=queue_limit,
                listen=listen,
            )
        )

    def _find_class(self, interface: type[Interface] | str, interface_id: str) -> type[Interface]:
        """Check the names and return the class."""
        check_names(interface if isinstance(interface, str) else interface.SCHEMA.name, interface_id)
        if not isinstance(interface, str):
            return interface
        try:
            return self.registry.get(interface)
        except InterfaceDefinitionError:
            raise  # the type exists, but its file is wrong: UnknownTypeError would hide the mistake
        except InterfaceError as error:
            raise UnknownTypeError(interface, hint=error.hint) from error

    @abstractmethod
    def _open(self, request: OpenRequest) -> Interface:
        """Open an interface as requested; :meth:`open_for_writing` lists the errors."""

    @abstractmethod
    def close(self, instance: Interface) -> None:
        """Close an instance, which becomes invalid. Closing it again has no effect.

        The interface disappears with its last instance. The last data remain readable after the writer's
        end as long as the interface has readers.

        :raises ForeignInstanceError: if the instance belongs to another blackboard.
        """

    @abstractmethod
    def shutdown(self) -> None:
        """Invalidate all instances and refuse new ones. Listeners are not called."""

    @abstractmethod
    def list(self, type_glob: str = "*", id_glob: str = "*") -> Sequence[InterfaceInfo]:
        """Return the matching interfaces, oldest first.

        :param type_glob: a shell pattern for the type: ``*``, ``?``, ``[seq]``, ``[!seq]``.
        :param id_glob: a shell pattern for the id.
        :raises BlackBoardError: if a remote blackboard was shut down or does not reply.
        """

    def list_all(self) -> Sequence[InterfaceInfo]:
        """Return all interfaces, as :meth:`list` without patterns does."""
        return self.list()

    @property
    def connected(self) -> bool:
        """Whether the interfaces are reachable; a local blackboard is always connected."""
        return True

    def add_connection_callback(self, callback: Callable[[bool], None]) -> None:  # noqa: B027 - a local blackboard has no connection
        """Register a callback for the loss and the return of the connection.

        :param callback: called in the thread of listeners, with False after the loss of the connection, and
            with True when all interfaces are open again. A local blackboard never calls it.
        """

    @property
    def skipped(self) -> int:
        """The number of updates that newer updates replaced before delivery, as far as known."""
        return 0

    def flush(self, timeout: float | None = None) -> None:  # noqa: B027 - a local blackboard delivers at once
        """Wait until the server has received all earlier calls and listeners have handled all earlier events.

        :param timeout: the limit in seconds; by default the timeout of requests.
        :raises BlackBoardError: after the timeout, or after the shutdown of a remote blackboard.
        """

    def register_listener(self, listener: Listener, instance: Interface, *kinds: EventKind) -> None:
        """Register a listener for events of an instance's interface, until the instance is closed.

        :param kinds: the events; by default the events whose methods the listener overrides, without
            messages if the instance is a reader.
        :raises ForeignInstanceError: if the instance is not open on this blackboard.
        :raises BlackBoardError: if ``kinds`` has messages and the instance is a reader.
        """
        listening(listener, *kinds)(instance, self._listener_table(instance))

    def unregister_listener(self, listener: Listener, instance: Interface) -> None:
        """Unregister a listener. Does nothing if it is not registered or the instance is closed."""
        if instance.valid:  # closing has unregistered the listeners of a closed instance
            self._listener_table(instance).unregister(listener, instance)

    @abstractmethod
    def _listener_table(self, instance: Interface) -> ListenerTable:
        """Return the listeners of an instance's interface."""

    def register_observer(self, observer: Observer, type_glob: str = "*", id_glob: str = "*") -> None:
        """Register an observer for the creation and end of matching interfaces."""
        self._observers.register(observer, type_glob, id_glob)

    def unregister_observer(self, observer: Observer) -> None:
        """Unregister an observer. Does nothing if it is not registered."""
        self._observers.unregister(observer)

    def refuse_message(self, sender: Interface, message: Message) -> NoReturn:
        """Log the refusal of a message to an interface without writer.

        :raises NoWriterError: always.
        """
        # the text of Fawkes' log line
        self.warn(
            f"Cannot transmit message from sender {message.sender_thread_name} via interface {sender.id} "
            f"(type {sender.type}), no writing instance exists!"
        )
        raise NoWriterError(sender.uid)

    def report_fault(self, operation: str, error: Exception) -> None:
        """Report an error of a listener or an observer.

        :param operation: the failed call and its interface, as text.
        """
        if self._log is None:
            import logging  # noqa: PLC0415 - slow to import, rarely needed

            logging.getLogger(__name__).error("%s failed", operation, exc_info=error)
        else:
            self._log.error(f"{operation} failed: {type(error).__name__}: {error}")

    def warn(self, text: str) -> None:
        """Log a warning if the blackboard has a bus."""
        if self._log is not None:
            self._log.warn(text)
