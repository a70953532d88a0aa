"""The store on MongoDB: outages, two databases, the configuration.

The tests run on a local server (see `mongo_server`).
"""

from __future__ import annotations

import time
from pathlib import Path

import pytest

pytest.importorskip("pymongo", reason="needs pymongo")

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import Clock, RealClock, VirtualClock
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.events import EventBus
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge_robot_memory.errors import UnreachableError
from cxbridge_robot_memory.memory import RobotMemory
from cxbridge_robot_memory.mongodb import store as mongo
from cxbridge_robot_memory.mongodb.store import MongoStore
from cxbridge_robot_memory.mutexes import Mutexes
from cxbridge_robot_memory.settings import RobotMemorySettings
from robot_memory_tests.mongo_server import MongoServer
from robot_memory_tests.test_store import Events

C = "robmem.test"
M = "robmem_coordination.mutex"


@pytest.fixture
def fast(monkeypatch):
    """Shorten the timeouts of an absent server."""
    monkeypatch.setattr(mongo, "_SELECTION_MS", 300)
    monkeypatch.setattr(mongo, "_PAUSE_S", 0.1)


def until(condition, seconds=20):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def wait_until_reachable(store):
    def is_reachable():
        try:
            store.find(C)
        except UnreachableError:
            return False
        return True

    until(is_reachable)


def test_store_continues_after_outage_of_database(fast):
    first = MongoServer()
    warnings: list[str] = []
    store = MongoStore(first.uri, warn=warnings.append)
    events = Events(store)
    store.insert(C, {"_id": 1})
    events.first(1)
    first.stop()
    with pytest.raises(UnreachableError):
        store.insert(C, {"_id": 2})
    until(lambda: warnings)
    first.store.insert(C, {"_id": 3})  # from another robot, during the outage
    with MongoServer(first.port, first) as second:
        wait_until_reachable(store)
        store.insert(C, {"_id": 4})
        assert [event["documentKey"]["_id"] for event in events.first(3)] == [1, 3, 4]
        until(lambda: len(warnings) == 2)
        assert second.store.find(C, {"_id": 4})
        store.close()
    assert "no events at present" in warnings[0]
    assert "reachable again" in warnings[1]


def test_store_starts_without_database(fast):
    with MongoServer() as server:
        pass
    store = MongoStore(server.uri)
    begin = time.monotonic()
    for operation in (
        lambda: store.insert(C, {}),
        lambda: store.find(C),
        lambda: store.watch(C, {}, print),
    ):
        with pytest.raises(UnreachableError, match="cannot be reached"):
            operation()
    assert time.monotonic() - begin < 20
    assert store.replica_set_status("robot-memory-local").primary == "PRIMARY_UNKNOWN"
    with MongoServer(server.port):
        wait_until_reachable(store)
        assert store.replica_set_status("robot-memory-local").member == "PRIMARY"
        store.close()


def test_shared_databases_are_on_shared_server():
    with MongoServer() as local, MongoServer() as shared:
        store = MongoStore(local.uri, shared.uri, ["robmem_coordination"])
        assert Mutexes(store, M, RealClock()).try_lock("m", "me")
        store.insert(C, {"a": 1})
        assert [len(server.store.find(name)) for server in (local, shared) for name in (C, M)] == [1, 0, 0, 1]
        store.create_index(C, {"a": 1, "b": -1}, unique=True)
        store.create_index(M, {"t": 1}, expire_after_s=5)
        assert [(index["key"], index["unique"]) for index in local.indexes] == [({"a": 1, "b": -1}, True)]
        assert [index["expireAfterSeconds"] for index in shared.indexes] == [5]
        store.close()


@pytest.mark.parametrize("uri", ["mongodb://", "mongodb://x:y:z", "http://x", ""])
def test_invalid_uri_is_refused(uri):
    with pytest.raises(ConfigError, match="cannot use the MongoDB"):
        MongoStore(uri)


def test_error_of_invalid_uri_hides_password():
    with pytest.raises(ConfigError) as caught:
        MongoStore("mongodb://me:hidden@x:y:z/")
    assert "hidden" not in str(caught.value)


FAWKES_CLIENTS = """
plugins:
  robot-memory:
    distributed-db-names: [shared]
    coordination: {database: shared, mutex-collection: locks}
  mongodb:
    clients:
      robot-memory-local: {enabled: true, mode: connection, hostport: "here:27021"}
      robot-memory-distributed:
        enabled: %s
        mode: replica_set
        name: rs
        hosts: ["a:1", "b:2"]
    replica-sets:
      managed-sets:
        one: {enabled: true}
        two: {enabled: false}
cxbridge: {robot-memory: {backend: mongodb}}
"""


def settings(text):
    return RobotMemorySettings.read(Configuration.from_text(text, "/folder/test.yaml"))


def test_settings_of_fawkes_are_read():
    found = settings(FAWKES_CLIENTS % "true")
    assert found.uri == "mongodb://here:27021/?directConnection=true"
    assert found.distributed_uri == "mongodb://a:1,b:2/?replicaSet=rs"
    assert (found.distributed_databases, found.mutex_collection, found.replica_sets) == (
        ("shared",),
        "shared.locks",
        ("one",),
    )
    assert settings(FAWKES_CLIENTS % "false").distributed_uri == ""


def test_default_is_embedded_store():
    found = settings("a: b")
    assert (found.backend, found.file, found.mutex_collection) == ("embedded", None, M)
    assert found.replica_sets == ("robot-memory-distributed", "robot-memory-local")


def test_single_uri_has_all_databases():
    text = 'cxbridge: {robot-memory: {backend: mongodb, uri: "mongodb://me:secret@h:1/"}}'
    found = settings(text)
    assert (found.uri, found.distributed_uri) == ("mongodb://me:secret@h:1/", "")


def memory(config: str, clock: Clock, folder: Path):
    bus = EventBus(clock)
    board = LocalBlackBoard(InterfaceRegistry(), clock, bus)
    return board, RobotMemory(Configuration.from_text(config, str(folder / "test.yaml")), clock, bus, board)


def test_mongodb_refuses_virtual_clock(tmp_path):
    board, robot_memory = memory("cxbridge: {robot-memory: {backend: mongodb}}", VirtualClock(), tmp_path)
    with pytest.raises(ConfigError, match="--clock real"):
        robot_memory.open()
    board.shutdown()


def test_interfaces_of_replica_sets_follow_database(fast, tmp_path):
    server = MongoServer()
    board, robot_memory = memory(
        f'cxbridge: {{robot-memory: {{backend: mongodb, uri: "{server.uri}"}}}}', RealClock(), tmp_path
    )
    robot_memory.open()
    interface = board.open_for_reading("MongoDBManagedReplicaSetInterface", "robot-memory-distributed")

    def shows(member, primary):
        robot_memory.loop()
        interface.read()
        return (interface.member_status.name, interface.primary_status.name) == (member, primary)

    until(lambda: shows("PRIMARY", "HAVE_PRIMARY"))
    server.stop()
    until(lambda: shows("UNKNOWN", "PRIMARY_UNKNOWN"))
    assert "robot-memory-distributed" in interface.error_msg
    with MongoServer(server.port, server):
        until(lambda: shows("PRIMARY", "HAVE_PRIMARY"))
        robot_memory.close()
    board.shutdown()
