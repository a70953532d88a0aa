"""Settings of the robot memory: Fawkes' keys, and cxbridge's below ``/cxbridge/robot-memory``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from cxbridge.config import Configuration
from cxbridge.run.plugin_settings import PluginSettings

BACKENDS = ("embedded", "mongodb")

_FAWKES_KEY = "/plugins/robot-memory"
_CXBRIDGE_KEY = "/cxbridge/robot-memory"
_REPLICA_SETS_KEY = "/plugins/mongodb/replica-sets/managed-sets"
_CLIENTS_KEY = "/plugins/mongodb/clients"
# the names of the clients, and of their replica sets, in Fawkes' configuration
_LOCAL_CLIENT = "robot-memory-local"
_DISTRIBUTED_CLIENT = "robot-memory-distributed"
_DEFAULT_SERVER = "localhost:27017"


@dataclass(frozen=True)
class RobotMemorySettings(PluginSettings):
    """Settings of the robot memory.

    :param backend: ``embedded`` or ``mongodb``.
    :param file: the file of a persistent embedded store; None keeps the documents in memory only.
    :param uri: the URI of this robot's MongoDB.
    :param distributed_uri: the URI of the MongoDB that robots share; empty if they share this robot's
        MongoDB.
    :param database: the database of documents that robots do not share.
    :param distributed_databases: the databases that robots share.
    :param mutex_collection: the collection of the mutexes.
    :param replica_sets: the ids of the interfaces about replica sets.
    """

    KEYS: ClassVar[tuple[str, ...]] = ("robot-memory/backend", "robot-memory/file", "robot-memory/uri")
    SECTION: ClassVar[str] = _CXBRIDGE_KEY

    backend: str = "embedded"
    file: Path | None = None
    uri: str = ""
    distributed_uri: str = ""
    database: str = "robmem"
    distributed_databases: tuple[str, ...] = ("syncedrobmem", "robmem_coordination")
    mutex_collection: str = "robmem_coordination.mutex"
    replica_sets: tuple[str, ...] = (_DISTRIBUTED_CLIENT, _LOCAL_CLIENT)

    @classmethod
    def read(cls, config: Configuration) -> RobotMemorySettings:
        """Read the settings.

        :raises ConfigError: if a value is wrong.
        """
        backend = config.get_str(f"{_CXBRIDGE_KEY}/backend", default=cls.backend)
        if backend not in BACKENDS:
            raise config.error(
                f"{_CXBRIDGE_KEY}/backend",
                f"{_CXBRIDGE_KEY}/backend cannot be '{backend}'",
                f"use one of: {', '.join(BACKENDS)}",
            )
        uri = config.get_str(f"{_CXBRIDGE_KEY}/uri", default=cls.uri)
        is_distributed = config.get_bool(f"{_CLIENTS_KEY}/{_DISTRIBUTED_CLIENT}/enabled", default=False)
        default_mutex_database, default_mutex_name = cls.mutex_collection.split(".")
        coordination_key = f"{_FAWKES_KEY}/coordination"
        mutex_database = config.get_str(f"{coordination_key}/database", default=default_mutex_database)
        mutex_name = config.get_str(f"{coordination_key}/mutex-collection", default=default_mutex_name)
        replica_sets = [
            name
            for name in config.keys(_REPLICA_SETS_KEY)
            if config.get_bool(f"{_REPLICA_SETS_KEY}/{name}/enabled", default=False)
        ]
        return cls(
            backend=backend,
            file=config.get_file(f"{_CXBRIDGE_KEY}/file"),
            uri=uri or _find_client_uri(config, _LOCAL_CLIENT),
            # a URI below cxbridge's key replaces the URIs of both clients in Fawkes' configuration
            distributed_uri=_find_client_uri(config, _DISTRIBUTED_CLIENT)
            if is_distributed and not uri
            else "",
            database=config.get_str(f"{_FAWKES_KEY}/database", default=cls.database),
            distributed_databases=tuple(
                config.get_strings(
                    f"{_FAWKES_KEY}/distributed-db-names", default=[*cls.distributed_databases]
                )
            ),
            mutex_collection=f"{mutex_database}.{mutex_name}",
            replica_sets=tuple(sorted(replica_sets)) or cls.replica_sets,
        )


def _find_client_uri(config: Configuration, name: str) -> str:
    """Return the URI of a configured MongoDB client; without a configuration, of a server on this machine.

    :raises ConfigError: if a value has the wrong type.
    """
    key = f"{_CLIENTS_KEY}/{name}"
    if config.get_str(f"{key}/mode", default="connection") == "replica_set":
        hosts = config.get_strings(f"{key}/hosts", default=[_DEFAULT_SERVER])
        return f"mongodb://{','.join(hosts)}/?replicaSet={config.get_str(f'{key}/name', default=name)}"
    return f"mongodb://{config.get_str(f'{key}/hostport', default=_DEFAULT_SERVER)}/?directConnection=true"
