"""Settings of the robot memory: Fawkes' keys, and cxbridge's below ``/cxbridge/robot-memory``."""

from __future__ import annotations

from pathlib import Path

from msgspec import Struct

from cxbridge.config import Configuration

BACKENDS = ("embedded", "mongodb")

_FAWKES = "/plugins/robot-memory"
_OURS = "/cxbridge/robot-memory"
_SETS = "/plugins/mongodb/replica-sets/managed-sets"
_CLIENTS = "/plugins/mongodb/clients"
_DEFAULT_SETS = ("robot-memory-distributed", "robot-memory-local")


class Settings(Struct, frozen=True):
    """Settings of the robot memory.

    :param backend: ``embedded`` or ``mongodb``.
    :param file: the file of a persistent embedded store; None keeps the documents in memory only.
    :param uri: the URI of this robot's MongoDB.
    :param distributed_uri: the URI of the MongoDB that robots share; empty if it is this robot's.
    :param database: the database of undistributed documents.
    :param distributed: the databases in the shared replica set.
    :param mutexes: the collection of the mutexes.
    :param sets: the ids of the interfaces about replica sets.
    """

    backend: str = "embedded"
    file: Path | None = None
    uri: str = ""
    distributed_uri: str = ""
    database: str = "robmem"
    distributed: tuple[str, ...] = ("syncedrobmem", "robmem_coordination")
    mutexes: str = "robmem_coordination.mutex"
    sets: tuple[str, ...] = _DEFAULT_SETS

    @property
    def place(self) -> str:
        """A description of the location of the documents."""
        if self.backend == "embedded":
            return f"in this process and in {self.file}" if self.file else "in this process only"
        # leave out the user and password before the @
        hosts = [
            uri.rpartition("@")[2].removeprefix("mongodb://") for uri in (self.uri, self.distributed_uri)
        ]
        return f"MongoDB {' and '.join(filter(None, hosts))}"

    @classmethod
    def read(cls, config: Configuration) -> Settings:
        """Read the settings.

        :raises ConfigError: if a value is wrong.
        """
        backend = config.get_str(f"{_OURS}/backend", default="embedded")
        if backend not in BACKENDS:
            message = f"{_OURS}/backend cannot be '{backend}'"
            raise config.error(f"{_OURS}/backend", message, f"use one of: {', '.join(BACKENDS)}")
        standard = cls()
        uri = config.get_str(f"{_OURS}/uri", default="")
        shared = config.get_bool(f"{_CLIENTS}/robot-memory-distributed/enabled", default=False)
        coordination = f"{_FAWKES}/coordination"
        database = config.get_str(f"{coordination}/database", default="robmem_coordination")
        mutexes = config.get_str(f"{coordination}/mutex-collection", default="mutex")
        distributed = config.get_strings(f"{_FAWKES}/distributed-db-names", default=[*standard.distributed])
        sets = [
            name for name in config.keys(_SETS) if config.get_bool(f"{_SETS}/{name}/enabled", default=False)
        ]
        return cls(
            backend=backend,
            file=config.get_file(f"{_OURS}/file"),
            uri=uri or client_uri(config, "robot-memory-local"),
            # a URI in cxbridge's own key replaces both of Fawkes' clients
            distributed_uri="" if uri or not shared else client_uri(config, "robot-memory-distributed"),
            database=config.get_str(f"{_FAWKES}/database", default=standard.database),
            distributed=tuple(distributed),
            mutexes=f"{database}.{mutexes}",
            sets=tuple(sorted(sets)) or _DEFAULT_SETS,
        )


def client_uri(config: Configuration, name: str) -> str:
    """Return the URI of a configured MongoDB client, by default at the default port.

    :raises ConfigError: if a value has the wrong type.
    """
    client = f"{_CLIENTS}/{name}"
    if config.get_str(f"{client}/mode", default="connection") == "replica_set":
        hosts = config.get_strings(f"{client}/hosts", default=["localhost:27017"])
        return f"mongodb://{','.join(hosts)}/?replicaSet={config.get_str(f'{client}/name', default=name)}"
    return (
        f"mongodb://{config.get_str(f'{client}/hostport', default='localhost:27017')}/?directConnection=true"
    )
