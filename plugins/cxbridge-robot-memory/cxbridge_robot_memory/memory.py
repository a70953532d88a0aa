"""The robot memory of a run: the configured store, and interfaces with its status.

Fawkes' configuration keys are below ``/plugins/robot-memory``, cxbridge's keys below
``/cxbridge/robot-memory``; see docs/several-agents.md.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

from cxbridge.blackboard import BlackBoard
from cxbridge.clock import Clock
from cxbridge.closing import Closing
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.events import EventBus, Logger
from cxbridge_robot_memory.errors import mongodb_install_command
from cxbridge_robot_memory.settings import RobotMemorySettings
from cxbridge_robot_memory.status_writer import StatusWriter

if TYPE_CHECKING:
    from cxbridge_robot_memory.store import Store

REPLICA_SET_INTERFACE = "MongoDBManagedReplicaSetInterface"


class RobotMemory(Closing):
    """The robot memory of one run, opened on first use.

    :param board: receives the interfaces about replica sets.
    :param make_embedded: opens the embedded store. A team gives a function, because its agents share parts of
        their stores; by default the store is unshared.
    :param is_volatile: whether to keep the documents in this process only, whatever the configuration says.
    """

    def __init__(
        self,
        config: Configuration,
        clock: Clock,
        bus: EventBus,
        board: BlackBoard,
        *,
        make_embedded: Callable[[RobotMemorySettings], Store] | None = None,
        is_volatile: bool = False,
    ) -> None:
        self._config = config
        self.clock = clock
        self._board = board
        self._lock = threading.RLock()
        self._make_embedded = make_embedded
        self._is_volatile = is_volatile
        self._store: Store | None = None
        self._status_writers: list[StatusWriter] = []
        self.bus = bus
        self.log: Logger = bus.logger("RobotMemory")

    @cached_property
    def settings(self) -> RobotMemorySettings:
        """The settings of the configuration.

        :raises ConfigError: if the configuration is wrong.
        """
        settings = RobotMemorySettings.read(self._config)
        return replace(settings, backend="embedded", file=None) if self._is_volatile else settings

    def open(self) -> Store:
        """Return the store. The first call opens the store, and writes the interfaces of replica sets.

        :raises CxbridgeError: if the configuration is wrong, the store cannot be opened, or an interface has
            another writer.
        """
        with self._lock:
            if self._store is not None:
                return self._store
            self._store = self._open_store()
            self.log.info(f"Robot memory: {self.settings.backend}")
            for name in self.settings.replica_sets:
                self._status_writers.append(
                    StatusWriter(
                        self._board.open_for_writing(REPLICA_SET_INTERFACE, name, owner="RobotMemory"),
                        self._store,
                    )
                )
            return self._store

    def _open_store(self) -> Store:
        settings = self.settings
        if settings.backend == "embedded":
            if self._make_embedded is not None:
                return self._make_embedded(settings)
            from cxbridge_robot_memory.embedded import EmbeddedStore  # noqa: PLC0415 - not needed with MongoDB

            return EmbeddedStore(self.clock, settings.file)
        if self.clock.is_virtual:
            raise ConfigError(
                "a robot memory on MongoDB cannot be used with --clock virtual",
                hint="the events of MongoDB arrive in real time: use --clock real",
            )
        try:
            from cxbridge_robot_memory.mongodb.store import MongoStore  # noqa: PLC0415 - pymongo takes a second
        except ModuleNotFoundError:
            raise ConfigError(
                "a robot memory on MongoDB requires the package pymongo",
                hint=mongodb_install_command(),
            ) from None

        return MongoStore(
            settings.uri, settings.distributed_uri, settings.distributed_databases, warn=self.log.warn
        )

    def loop(self) -> None:
        """Write the interfaces whose status has changed. The main loop calls this method in each cycle."""
        for writer in self._status_writers:
            writer.write()

    def close(self) -> None:
        """Close store and interfaces. Further calls do nothing."""
        with self._lock:
            for writer in self._status_writers:
                writer.close()
            self._status_writers.clear()
            if self._store is not None:
                self._store.close()
            self._store = None
