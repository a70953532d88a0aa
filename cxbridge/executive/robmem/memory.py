"""The robot memory of an application: the store that the configuration asks for, and how it stands.

Configuration keys are Fawkes' (``/plugins/robot-memory``), those of our own are below
``/cxbridge/robot-memory``: see docs/robot-memory.md.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cxbridge.blackboard import BlackBoard
from cxbridge.clock import Clock
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.events import EventBus, Logger
from cxbridge.interfaces.instance import Interface

if TYPE_CHECKING:
    from cxbridge.executive.robmem.store import Store

BACKENDS = ("embedded", "mongodb")
INTERFACE = "MongoDBManagedReplicaSetInterface"

_FAWKES = "/plugins/robot-memory"
_OURS = "/cxbridge/robot-memory"
_SETS = "/plugins/mongodb/replica-sets/managed-sets"
_DEFAULT_SETS = ("robot-memory-distributed", "robot-memory-local")


@dataclass(frozen=True)
class Settings:
    """What the configuration says of the robot memory.

    :param backend: ``embedded`` or ``mongodb``.
    :param file: where the embedded store survives; None: nowhere.
    :param uri: of a MongoDB for everything; empty: Fawkes' clients.
    :param database: what is not distributed lies here.
    :param distributed: databases of the set that robots share.
    :param mutexes: the collection of mutexes.
    :param sets: ids of the interfaces that tell of replica sets.
    """

    backend: str = "embedded"
    file: Path | None = None
    uri: str = ""
    database: str = "robmem"
    distributed: tuple[str, ...] = ("syncedrobmem", "robmem_coordination")
    mutexes: str = "robmem_coordination.mutex"
    sets: tuple[str, ...] = _DEFAULT_SETS

    @property
    def place(self) -> str:
        """Where the documents are, in words."""
        if self.backend == "embedded":
            return f"in this process and in {self.file}" if self.file else "in this process only"
        return f"MongoDB {self.uri}" if self.uri else "MongoDB"

    @classmethod
    def read(cls, config: Configuration, folder: Path) -> Settings:
        """Read them.

        :param folder: relative files are seen from here.
        :raises ConfigError: when a value is of another type, or none of those it can be.
        """
        backend = config.get_str(f"{_OURS}/backend", default="embedded")
        if backend not in BACKENDS:
            place = config.get(f"{_OURS}/backend")
            raise ConfigError(
                f"{_OURS}/backend cannot be '{backend}'",
                file=place.file,
                line=place.line,
                hint=f"use one of: {', '.join(BACKENDS)}",
            )
        file = config.get_str(f"{_OURS}/file", default="")
        coordination = f"{_FAWKES}/coordination"
        database = config.get_str(f"{coordination}/database", default="robmem_coordination")
        mutexes = config.get_str(f"{coordination}/mutex-collection", default="mutex")
        distributed = config.get_strings(f"{_FAWKES}/distributed-db-names", default=[*cls.distributed])
        sets = [
            name for name in config.keys(_SETS) if config.get_bool(f"{_SETS}/{name}/enabled", default=False)
        ]
        return cls(
            backend=backend,
            file=folder / file if file else None,
            uri=config.get_str(f"{_OURS}/uri", default=""),
            database=config.get_str(f"{_FAWKES}/database", default=cls.database),
            distributed=tuple(distributed),
            mutexes=f"{database}.{mutexes}",
            sets=tuple(sorted(sets)) or _DEFAULT_SETS,
        )


class RobotMemory:
    """The robot memory of one application, opened when somebody needs it first.

    :param config: the configuration; read when it is opened.
    :param board: the interfaces that tell of the replica sets are written here.
    :param folder: relative files are seen from here.
    :param store: one that this application shares with others, who close it; None: its own.
    """

    def __init__(
        self,
        config: Configuration,
        clock: Clock,
        bus: EventBus,
        board: BlackBoard,
        folder: Path,
        *,
        store: Store | None = None,
    ) -> None:
        self._config = config
        self._clock = clock
        self._board = board
        self._folder = folder
        self._lock = threading.RLock()
        self._settings: Settings | None = None
        self._shared = store
        self._store: Store | None = None
        self._interfaces: list[Interface] = []
        self.bus = bus
        self.log: Logger = bus.logger("RobotMemory")

    @property
    def settings(self) -> Settings:
        """What the configuration says.

        :raises ConfigError: when it is wrong.
        """
        if self._settings is None:
            self._settings = Settings.read(self._config, self._folder)
        return self._settings

    @property
    def clock(self) -> Clock:
        """The clock of the run."""
        return self._clock

    @property
    def store(self) -> Store:
        """The store, opened by the first who asks.

        :raises CxbridgeError: when it cannot be opened.
        """
        with self._lock:
            if self._store is None:
                self.open()
            assert self._store is not None
            return self._store

    def open(self) -> None:
        """Open the store and write the interfaces of the replica sets. A second call does nothing.

        :raises CxbridgeError: when the configuration is wrong, or the store cannot be opened.
        """
        with self._lock:
            if self._store is not None:
                return
            self._store = self._shared or _open_store(self.settings, self._clock)
            self.log.info(f"Robot memory: {'shared' if self._shared else self.settings.place}")
            self._write_sets()

    def _write_sets(self) -> None:
        """Tell that each replica set is up: the embedded store always is."""
        for name in self.settings.sets:
            interface = self._board.open_for_writing(INTERFACE, name, owner="RobotMemory")
            interface.set("member_status", 1)
            interface.set("primary_status", 1)
            interface.write()
            self._interfaces.append(interface)

    def attend(self) -> None:
        """Do what is due: called once a loop, by the feature."""
        if self._store is not None:
            self._store.attend()

    def close(self) -> None:
        """Close the store and the interfaces. A second call does nothing."""
        with self._lock:
            for interface in self._interfaces:
                interface.close()
            self._interfaces.clear()
            if self._store is not None and self._shared is None:
                self._store.close()
            self._store = None


def _open_store(settings: Settings, clock: Clock) -> Store:
    # bson takes a tenth of a second to import, and most runs have no robot memory
    from cxbridge.executive.robmem.embedded import EmbeddedStore  # noqa: PLC0415

    return EmbeddedStore(clock, settings.file)
