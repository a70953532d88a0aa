"""The store on MongoDB: a database that goes away and comes back, two of them, the configuration.

Runs on a server of the tests' own (see `mongo_server`).
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
from cxbridge_robot_memory.settings import Settings
from robot_memory_tests.mongo_server import MongoServer
from robot_memory_tests.test_store import Events

C = "robmem.test"
M = "robmem_coordination.mutex"


@pytest.fixture
def fast(monkeypatch):
    """Fail early when a server is away."""
    monkeypatch.setattr(mongo, "_SELECTION_MS", 300)
    monkeypatch.setattr(mongo, "_PAUSE_S", 0.1)


def until(condition, seconds=20):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def comes_back(store):
    def there():
        try:
            store.find(C)
        except UnreachableError:
            return False
        return True

    until(there)


def test_a_database_goes_away_and_comes_back(fast):
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
    first.store.insert(C, {"_id": 3})  # of another robot, during the outage
    with MongoServer(first.port, first) as second:
        comes_back(store)
        store.insert(C, {"_id": 4})
        assert [event["documentKey"]["_id"] for event in events.first(3)] == [1, 3, 4]
        until(lambda: len(warnings) == 2)
        assert second.store.find(C, {"_id": 4})
        store.close()
    assert "no events at present" in warnings[0]
    assert "reachable again" in warnings[1]


def test_a_database_that_is_away_at_the_start(fast):
    with MongoServer() as gone:
        pass
    store = MongoStore(gone.uri)
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
    with MongoServer(gone.port):
        comes_back(store)
        assert store.replica_set_status("robot-memory-local").member == "PRIMARY"
        store.close()


def test_what_robots_share_is_in_the_shared_set():
    with MongoServer() as own, MongoServer() as shared:
        store = MongoStore(own.uri, shared.uri, ["robmem_coordination"])
        assert Mutexes(store, M, RealClock()).try_lock("m", "me")
        store.insert(C, {"a": 1})
        assert [len(server.store.find(name)) for server in (own, shared) for name in (C, M)] == [1, 0, 0, 1]
        store.create_index(C, {"a": 1, "b": -1}, unique=True)
        store.create_index(M, {"t": 1}, expire_after_s=5)
        assert [(index["key"], index["unique"]) for index in own.indexes] == [({"a": 1, "b": -1}, True)]
        assert [index["expireAfterSeconds"] for index in shared.indexes] == [5]
        store.close()


@pytest.mark.parametrize("uri", ["mongodb://", "mongodb://x:y:z", "http://x", ""])
def test_what_is_no_uri_is_refused(uri):
    with pytest.raises(ConfigError, match="cannot use the MongoDB"):
        MongoStore(uri)


def test_the_password_of_a_uri_that_is_refused_is_not_told():
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
    return Settings.read(Configuration.from_text(text, "/folder/test.yaml"))


def test_the_settings_are_fawkes():
    found = settings(FAWKES_CLIENTS % "true")
    assert found.uri == "mongodb://here:27021/?directConnection=true"
    assert found.distributed_uri == "mongodb://a:1,b:2/?replicaSet=rs"
    assert (found.distributed_databases, found.mutex_collection, found.replica_sets) == (
        ("shared",),
        "shared.locks",
        ("one",),
    )
    assert settings(FAWKES_CLIENTS % "false").distributed_uri == ""


def test_without_a_configuration_it_is_in_this_process():
    found = settings("a: b")
    assert (found.backend, found.file, found.mutex_collection) == ("embedded", None, M)
    assert found.replica_sets == ("robot-memory-distributed", "robot-memory-local")


def test_one_uri_is_for_everything():
    text = 'cxbridge: {robot-memory: {backend: mongodb, uri: "mongodb://me:secret@h:1/"}}'
    found = settings(text)
    assert (found.uri, found.distributed_uri) == ("mongodb://me:secret@h:1/", "")


def memory(config: str, clock: Clock, folder: Path):
    bus = EventBus(clock)
    board = LocalBlackBoard(InterfaceRegistry(), clock, bus)
    return board, RobotMemory(Configuration.from_text(config, str(folder / "test.yaml")), clock, bus, board)


def test_mongodb_cannot_go_with_a_virtual_clock(tmp_path):
    board, robot_memory = memory("cxbridge: {robot-memory: {backend: mongodb}}", VirtualClock(), tmp_path)
    with pytest.raises(ConfigError, match="--clock real"):
        robot_memory.open()
    board.shutdown()


def test_the_interfaces_of_the_sets_follow_the_database(fast, tmp_path):
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


HOLDER = """
import sys, time
from cxbridge.clock import RealClock
from cxbridge_robot_memory.mongodb.store import MongoStore
from cxbridge_robot_memory.mutexes import Mutexes
mutexes = Mutexes(MongoStore(sys.argv[1]), "robmem_coordination.mutex", RealClock())
print(mutexes.try_lock("m", "holder"), flush=True)
while True:
    time.sleep(0.1)
    mutexes.renew("m", "holder")
"""
