"""The robot memory of an application: the store that the configuration asks for, and how it stands.

Configuration keys are Fawkes' (``/plugins/robot-memory``), the keys of cxbridge are below
``/cxbridge/robot-memory``: see docs/robot-memory.md.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from cxbridge.blackboard import BlackBoard
from cxbridge.clock import Clock
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.events import EventBus, Logger
from cxbridge.executive.robmem.errors import RobotMemoryError
from cxbridge.executive.robmem.settings import Settings
from cxbridge.executive.robmem.status_writer import SetKeeper
from cxbridge.extras import install_command

if TYPE_CHECKING:
    from cxbridge.executive.robmem.store import Store

INTERFACE = "MongoDBManagedReplicaSetInterface"


class RobotMemory:
    """The robot memory of one application, opened at the first use.

    :param config: the configuration; read when it is opened.
    :param board: the interfaces that describe the replica sets are written here.
    :param store: a store that other applications use, too, and close; None: a new one.
    :param embedded: makes the embedded store; None: one without anything shared.
    """

    def __init__(
        self,
        config: Configuration,
        clock: Clock,
        bus: EventBus,
        board: BlackBoard,
        *,
        store: Store | None = None,
        embedded: Callable[[Settings], Store] | None = None,
    ) -> None:
        self._config = config
        self._clock = clock
        self._board = board
        self._lock = threading.RLock()
        self._settings: Settings | None = None
        self._shared = store
        self._embedded = embedded
        self._store: Store | None = None
        self._sets: list[SetKeeper] = []
        self.bus = bus
        self.log: Logger = bus.logger("RobotMemory")

    @property
    def settings(self) -> Settings:
        """The settings in the configuration.

        :raises ConfigError: when it is wrong.
        """
        if self._settings is None:
            self._settings = Settings.read(self._config)
        return self._settings

    @property
    def clock(self) -> Clock:
        """The clock of the run."""
        return self._clock

    @property
    def store(self) -> Store:
        """The store, opened at the first access.

        :raises CxbridgeError: when it cannot be opened.
        """
        with self._lock:
            if self._store is None:
                self.open()
            assert self._store is not None
            return self._store

    @property
    def is_open(self) -> bool:
        """Whether the store is open."""
        return self._store is not None

    def open(self) -> None:
        """Open the store and write the interfaces of the replica sets. A second call does nothing.

        :raises CxbridgeError: when the configuration is wrong, or the store cannot be opened.
        """
        with self._lock:
            if self._store is not None:
                return
            self._store = self._shared or self._open_store()
            self.log.info(f"Robot memory: {'shared' if self._shared else self.settings.place}")
            for name in self.settings.sets:
                interface = self._board.open_for_writing(INTERFACE, name, owner="RobotMemory")
                self._sets.append(SetKeeper(interface, self._store))

    def _open_store(self) -> Store:
        # pymongo takes a second to import
        settings = self.settings
        if settings.backend == "embedded":
            if self._embedded is not None:
                return self._embedded(settings)
            from cxbridge.executive.robmem.embedded import EmbeddedStore  # noqa: PLC0415

            return EmbeddedStore(self._clock, settings.file)
        if self._clock.is_virtual:
            raise ConfigError(
                "a robot memory on MongoDB cannot go with --clock virtual",
                hint="events come in real time: use --clock real",
            )
        try:
            from cxbridge.executive.robmem.mongodb.store import MongoStore  # noqa: PLC0415
        except ModuleNotFoundError:
            raise ConfigError(
                "a robot memory on MongoDB needs the package pymongo",
                hint=f"pip install 'cxbridge[mongodb]', here {install_command('mongodb')}",
            ) from None

        return MongoStore(settings.uri, settings.distributed_uri, settings.distributed, warn=self.log.warn)

    def attend(self) -> None:
        """Let the store expire documents, write the interfaces: called once a loop."""
        if self._store is not None:
            try:
                self._store.attend()
            except RobotMemoryError as error:
                self.log.error(str(error))
        for keeper in self._sets:
            keeper.write()

    def close(self) -> None:
        """Close the store and the interfaces. A second call does nothing."""
        with self._lock:
            for keeper in self._sets:
                keeper.close()
            self._sets.clear()
            if self._store is not None and self._shared is None:
                self._store.close()
            self._store = None
