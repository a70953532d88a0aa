"""The CLIPS functions of the feature `robot_memory`, beyond their rows in function_rows."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from cxbridge.config import Configuration
from cxbridge.events import Level
from cxbridge.executive.host.values import FALSE, TRUE, ExternalAddress, Symbol
from cxbridge.executive.manager import EnvironmentManager
from cxbridge_robot_memory.embedded import EmbeddedStore
from cxbridge_robot_memory.feature.feature import RobotMemoryFeature
from cxbridge_robot_memory.memory import RobotMemory
from tests.support import needs_pymongo

C = "robmem.test"
MUTEXES = "robmem_coordination.mutex"


@pytest.fixture
def feature(memory, tmp_path):
    return RobotMemoryFeature(memory, placeholders={"BASEDIR": str(tmp_path)})


@pytest.fixture
def manager(bus, feature, log):
    manager = EnvironmentManager(bus, [feature])
    yield manager
    manager.close()


@pytest.fixture
def env(manager):
    env = manager.create("executive")
    assert manager.request("executive", "robot_memory") == TRUE
    return env


@pytest.fixture
def call(env):
    return env.call


@pytest.fixture
def doc(call):
    """Return a function that makes a document from JSON."""

    def make(text="{}"):
        return call("bson-parse", text)

    return make


def loop(env, manager):
    """Run a loop of the executive."""
    with env.lock:
        manager.before_run("executive")
        return env.run()


def ordered_facts(env, relation):
    return [slots["implied"] for _, _, slots in env.facts(relation)]


def problems(log):
    return log.texts(Level.WARN, Level.ERROR)


def contents(memory, collection=C):
    return [
        {name: value for name, value in document.items() if name != "_id"}
        for document in memory.open().find(collection)
    ]


# --- documents --------------------------------------------------------------------------------------------


def test_document_has_values_of_all_clips_types(call, doc):
    new = call("bson-create")
    call("bson-append", new, "float", 2.5)
    call("bson-append", new, Symbol("int"), 2**40)
    call("bson-append", new, "symbol", Symbol("TRUE"))
    call("bson-append", new, "text", "käse")
    call("bson-append", new, "below", doc('{"a": 1}'))
    call("bson-append-array", new, "list", (1, Symbol("a"), "b", 2.5, doc('{"x": []}')))
    call("bson-append-regex", new, "pattern", "^a")
    call("bson-append-time", new, "time", (12, 345678))
    array = call("bson-array-start")
    call("bson-array-append", array, 1)
    call("bson-array-append", array, Symbol("x"))
    call("bson-array-finish", new, "array", array)
    assert call("bson-tostring", new) == (
        '{ "float" : 2.5, "int" : 1099511627776, "symbol" : "TRUE", "text" : "käse", '
        '"below" : { "a" : 1 }, "list" : [ 1, "a", "b", 2.5, { "x" : [  ] } ], '
        '"pattern" : { "$regex" : "^a", "$options" : "" }, "time" : { "$date" : 12345 }, '
        '"array" : [ 1, "x" ] }'
    )
    assert call("bson-field-names", new)[:3] == ("float", "int", "symbol")
    assert call("bson-get-time", new, "time") == (12, 345000)


def test_values_of_document_have_clips_types(call, doc):
    new = doc(
        '{"f": 1.0, "i": 3, "t": "x", "yes": true, "no": false, "null": null, "l": [1, "a", true],'
        ' "d": {"e": {"f": 7}}, "id": {"$oid": "0123456789abcdef01234567"}, "at": {"$date": 1500}}'
    )
    assert [call("bson-get", new, name) for name in ("f", "i", "t")] == [1.0, 3, "x"]
    assert [call("bson-get", new, name) for name in ("yes", "no")] == [TRUE, FALSE]
    assert isinstance(call("bson-get", new, "yes"), Symbol)
    assert call("bson-get", new, "id") == "0123456789abcdef01234567"
    assert call("bson-get", new, "d.e.f") == 7
    assert call("bson-get", call("bson-get", new, "d"), "e.f") == 7
    assert [call("bson-get", new, name) for name in ("null", "l", "at")] == ["INVALID_VALUE_TYPE"] * 3
    assert call("bson-get-array", new, "l") == (1, "a", TRUE)
    assert call("bson-get-time", new, "at") == (1, 500_000)
    assert [call("bson-has-field", new, name) for name in ("d.e", "d.x", "t.x", "null")] == [
        TRUE,
        FALSE,
        FALSE,
        TRUE,
    ]


def test_document_errors_are_logged(call, doc, log):
    new = doc('{"a": 1, "mixed": [1, null]}')
    assert call("bson-get", new, "b") == FALSE
    assert call("bson-get-array", new, "a") == (FALSE,)
    assert call("bson-get-array", new, "mixed") == (FALSE,)
    assert call("bson-get-time", new, "a") == (FALSE,)
    assert call("bson-get-time", new, "b") == (FALSE, FALSE)
    call("bson-append-regex", new, "r", Symbol("x"))
    call("bson-append-time", new, "t", (1,))
    call("bson-append-time", new, "t", (1, 2.5))
    call("bson-append-time", new, "t", (10**15, 0))
    assert call("bson-field-names", doc("{broken")) == ()
    assert call("bson-field-names", doc("[1]")) == ()
    assert call("bson-field-names", new) == ("a", "mixed")
    assert call("robmem-query", C, doc('{"name": {"$near": 1}}')) == FALSE
    call("robmem-update", C, doc('{"name": "x", "name.first": "y"}'), doc())
    texts = problems(log)
    for part in (
        "$near needs MongoDB",
        "conflict at 'name'",
        "no such element in doc: { ",
        "field a is not an array",
        "field a is not a time",
        "Regex string has to be of type string",
        "Invalid time",
        "is not a date",
        "Parsing JSON doc failed",
    ):
        assert [text for text in texts if part in text], part


@pytest.mark.parametrize(
    ("function", "more", "result"),
    [
        ("bson-tostring", (), ""),
        ("bson-append", ("x", 1), None),
        ("bson-append-array", ("x", ()), None),
        ("bson-field-names", (), (FALSE,)),
        ("bson-has-field", ("x",), FALSE),
        ("bson-get", ("x",), FALSE),
        ("bson-get-array", ("x",), (FALSE,)),
        ("bson-get-time", ("x",), (FALSE,)),
        ("bson-destroy", (), None),
    ],
)
def test_stale_handles_are_errors(call, doc, log, function, more, result):
    destroyed = doc()
    call("bson-destroy", destroyed)
    cursor = call("robmem-query", C, doc())
    for address, words in (
        (destroyed, "was destroyed before"),
        (ExternalAddress(0), "this is not a document"),
        (ExternalAddress(1 << 40), "this is not a document"),  # a handle of another feature
        (FALSE, "this is not a document: FALSE"),
        (cursor, "this is a cursor, not a document"),
        (call("bson-array-start"), "this is an array, not a document"),
    ):
        assert call(function, address, *more) == result
        assert words in problems(log)[-1]


# --- collections ------------------------------------------------------------------------------------------


def test_insert_update_replace_and_remove(call, doc, memory):
    call("robmem-insert", C, doc('{"a": 1, "b": 1}'))
    call("robmem-upsert", C, doc('{"a": 2}'), doc('{"a": 2}'))
    call("robmem-upsert", C, doc('{"b": 2}'), '{"a": 2}')
    call("robmem-update", C, doc('{"b": 3}'), '{"a": 1}')
    call("robmem-update", C, doc('{"b": 3}'), '{"a": 9}')
    assert contents(memory) == [{"a": 1, "b": 3}, {"a": 2, "b": 2}]
    call("robmem-replace", C, doc('{"c": 4}'), '{"a": 1}')
    assert contents(memory)[0] == {"a": 1, "b": 3, "c": 4}
    call("robmem-remove", C, doc('{"a": 2}'))
    assert len(contents(memory)) == 1


def test_cursor_iterates_over_query_result(call, doc):
    for number in (1, 3, 2):
        call("robmem-insert", C, doc(f'{{"n": {number}}}'))
    cursor = call("robmem-query-sort", C, doc('{"n": {"$gt": 1}}'), doc('{"n": -1}'))
    found = []
    while (document := call("robmem-cursor-next", cursor)) != FALSE:
        found.append(call("bson-get", document, "n"))
    assert found == [3, 2]
    assert call("robmem-cursor-next", cursor) == FALSE
    call("robmem-cursor-destroy", cursor)
    assert call("robmem-cursor-next", call("robmem-query", C, doc('{"n": 7}'))) == FALSE


def test_late_upsert_is_no_error(call, doc, log, memory):
    call("robmem-insert", C, doc('{"_id": "x", "n": 5}'))
    call("robmem-upsert", C, doc('{"_id": "x", "n": 3}'), doc('{"_id": "x", "n": {"$lte": 3}}'))
    assert contents(memory) == [{"n": 5}]
    assert problems(log) == []


@needs_pymongo
def test_collection_is_dumped_and_restored(call, doc, log, memory, tmp_path):
    for number in range(3):
        call("robmem-insert", C, doc(f'{{"_id": {number}, "l": [{number}]}}'))
    before = memory.open().find(C)
    assert call("robmem-dump-collection", C, "@BASEDIR@/dump") == TRUE
    assert (tmp_path / "dump" / "robmem" / "test.bson").is_file()
    call("robmem-insert", C, doc('{"_id": 7}'))
    assert call("robmem-restore-collection", C, f"{tmp_path}/dump", "") == TRUE
    assert memory.open().find(C) == before
    assert call("robmem-restore-collection", C, f"{tmp_path}/dump", "robmem.copy") == TRUE
    assert memory.open().find("robmem.copy") == before
    assert problems(log) == []


@needs_pymongo
def test_invalid_dump_changes_nothing(call, doc, log, memory, tmp_path):
    call("robmem-insert", C, doc('{"_id": 1}'))
    assert call("robmem-restore-collection", C, f"{tmp_path}/nowhere", "") == FALSE
    (tmp_path / "robmem").mkdir()
    for rubbish in (b"rubbish that is long enough", b"\x05\x00\x00\x00\x00\x10", b"\xff\xff\xff\x7f\x00\x00"):
        (tmp_path / "robmem" / "test.bson").write_bytes(rubbish)
        assert call("robmem-restore-collection", C, str(tmp_path), "") == FALSE
    assert call("robmem-dump-collection", C, str(Path("/proc/nowhere"))) == FALSE
    assert len(problems(log)) == 5
    assert memory.open().find(C) == [{"_id": 1}]


# --- triggers ---------------------------------------------------------------------------------------------


def register(env, manager, call, name="seen", collection=C, query="{}"):
    assert call("robmem-trigger-register", collection, call("bson-parse", query), name) == TRUE
    loop(env, manager)
    return next(
        fields[2] for fields in ordered_facts(env, "mutex-trigger-register-feedback") if fields[1] == name
    )


def test_failed_registration_has_feedback(call, doc, env, manager, log):
    call("robmem-trigger-register", "nowhere", doc(), "seen")
    assert call("robmem-trigger-register", C, FALSE, "seen") == FALSE
    loop(env, manager)
    assert ordered_facts(env, "mutex-trigger-register-feedback") == [("FAIL", "seen")]
    assert len(problems(log)) == 2


def test_trigger_events_have_order_and_distinct_times(call, doc, env, manager):
    register(env, manager, call)
    env.build(
        "(defrule take ?e <- (robmem-trigger (name ?n) (rcvd-at $?t) (ptr ?p))"
        " (not (robmem-trigger (rcvd-at $?u&:(time> ?t ?u))))"
        ' => (retract ?e) (assert (took ?n (bson-get ?p "operationType") ?t)) (bson-destroy ?p))'
    )
    call("robmem-insert", C, doc('{"_id": 1}'))
    call("robmem-update", C, doc('{"a": 1}'), '{"_id": 1}')
    call("robmem-remove", C, doc('{"_id": 1}'))
    assert list(env.facts("robmem-trigger")) == []
    loop(env, manager)
    took = ordered_facts(env, "took")
    assert [fields[:2] for fields in took] == [("seen", "insert"), ("seen", "update"), ("seen", "delete")]
    assert len({fields[2:] for fields in took}) == 3
    assert ordered_facts(env, "seen") == [()]


def test_destroyed_trigger_has_no_events(call, doc, env, manager, log):
    pointer = register(env, manager, call)
    call("robmem-trigger-destroy", pointer)
    call("robmem-insert", C, doc())
    loop(env, manager)
    assert ordered_facts(env, "seen") == []
    assert problems(log) == []
    call("robmem-trigger-destroy", pointer)
    assert "was destroyed before" in problems(log)[0]


# --- mutexes ----------------------------------------------------------------------------------------------


def mutex(memory, name="m"):
    return next(iter(memory.open().find(MUTEXES, {"_id": name})), None)


def test_mutex_operations_from_create_to_destroy(call, memory):
    assert call("robmem-mutex-create", "m") == TRUE
    assert call("robmem-mutex-create", "m") == FALSE
    assert mutex(memory) == {"_id": "m", "locked": False}
    assert call("robmem-mutex-try-lock", "m", "me") == TRUE
    assert mutex(memory)["locked-by"] == "me"
    assert call("robmem-mutex-try-lock", "m", "other") == FALSE
    assert call("robmem-mutex-try-lock", "m", "me") == FALSE
    assert call("robmem-mutex-renew-lock", "m", "other") == FALSE
    assert call("robmem-mutex-renew-lock", "m", "me") == TRUE
    assert call("robmem-mutex-unlock", "m", "other") == FALSE
    assert call("robmem-mutex-force-lock", "m", "other") == TRUE
    assert call("robmem-mutex-unlock", "m", "other") == TRUE
    assert mutex(memory) == {"_id": "m", "locked": False}
    assert call("robmem-mutex-destroy", "m") == TRUE
    assert mutex(memory) is None


def test_asynchronous_operations_have_feedback(call, env, manager):
    assert call("robmem-mutex-create-async", "m") == (TRUE,)
    assert call("robmem-mutex-try-lock-async", "m", "me") == (TRUE,)
    assert call("robmem-mutex-try-lock-async", "m", "other") == (TRUE,)
    assert call("robmem-mutex-renew-lock-async", "m", "me") == (TRUE,)
    assert call("robmem-mutex-renew-lock-async", "m", "other") == (TRUE,)
    assert call("robmem-mutex-force-lock-async", "m", "other") == (TRUE,)
    assert call("robmem-mutex-unlock-async", "m", "other") == (TRUE,)
    assert call("robmem-mutex-destroy-async", "m") == (TRUE,)
    assert call("robmem-mutex-expire-locks-async", 1.0) == TRUE
    assert ordered_facts(env, "mutex-op-feedback") == []
    loop(env, manager)
    assert ordered_facts(env, "mutex-op-feedback") == [
        ("try-lock-async", "FAIL", "m"),
        ("renew-lock-async", "OK", "m"),
        ("renew-lock-async", "FAIL", "m"),
        ("expire-locks-async", "OK"),
    ]


class SlowStore(EmbeddedStore):
    """A remote store whose answers wait for ``go``."""

    is_local = False

    def __init__(self, clock):
        super().__init__(clock)
        self.go = threading.Event()

    def find_one_and_update(self, *args, **options):
        assert self.go.wait(20)
        return super().find_one_and_update(*args, **options)


def start_robot(store, bus, board):
    memory = RobotMemory(
        Configuration.from_text("a: b", "test.yaml"),
        bus.clock,
        bus,
        board,
        make_embedded=lambda _settings: store,
    )
    manager = EnvironmentManager(bus, [RobotMemoryFeature(memory)])
    env = manager.create("executive")
    manager.request("executive", "robot_memory")
    return memory, manager, env


def loop_until(env, manager, count, relation="mutex-op-feedback"):
    for _ in range(2000):
        loop(env, manager)
        if len(ordered_facts(env, relation)) >= count:
            return ordered_facts(env, relation)
        threading.Event().wait(0.01)
    raise AssertionError(ordered_facts(env, relation))


def test_mutex_has_one_operation_at_a_time(bus, board, tmp_path):
    store = SlowStore(bus.clock)
    memory, manager, env = start_robot(store, bus, board)
    assert env.call("robmem-mutex-try-lock-async", "m", "me") == (TRUE,)
    busy = (FALSE, "Task already running for m (try-lock failed)")
    assert env.call("robmem-mutex-try-lock-async", "m", "me") == busy
    assert env.call("robmem-mutex-unlock-async", "m", "me")[0] == FALSE
    assert env.call("robmem-mutex-try-lock-async", "other", "me") == (TRUE,)
    loop(env, manager)
    assert ordered_facts(env, "mutex-op-feedback") == [("try-lock-async", "FAIL", "m")]
    store.go.set()
    manager.close()  # waits for the running operations
    assert {document["_id"] for document in store.find(MUTEXES, {"locked": True})} == {"m", "other"}
    memory.close()


@needs_pymongo
def test_unreachable_database_fails_all_functions(bus, board, tmp_path, log, monkeypatch):
    from cxbridge_robot_memory.mongodb import store as mongo
    from robot_memory_tests.mongo_server import MongoServer

    monkeypatch.setattr(mongo, "_SELECTION_MS", 200)
    with MongoServer() as server:
        pass
    store = mongo.MongoStore(server.uri)
    memory, manager, env = start_robot(store, bus, board)
    empty = env.call("bson-create")
    assert env.call("robmem-query", C, empty) == FALSE
    env.call("robmem-insert", C, empty)
    assert env.call("robmem-dump-collection", C, str(tmp_path)) == FALSE
    for name in ("create", "destroy"):
        assert env.call(f"robmem-mutex-{name}", "m") == FALSE
    for name in ("try-lock", "force-lock", "renew-lock", "unlock"):
        assert env.call(f"robmem-mutex-{name}", "m", "me") == FALSE
        assert env.call(f"robmem-mutex-{name}-async", f"{name}-mutex", "me") == (TRUE,)
    for name in ("setup-ttl", "expire-locks"):
        assert env.call(f"robmem-mutex-{name}", 1.0) == FALSE
    assert env.call("robmem-mutex-expire-locks-async", 1.0) == TRUE
    assert set(loop_until(env, manager, 3)) == {
        ("try-lock-async", "FAIL", "try-lock-mutex"),
        ("renew-lock-async", "FAIL", "renew-lock-mutex"),
        ("expire-locks-async", "FAIL"),
    }
    assert env.call("robmem-trigger-register", C, empty, "news") == TRUE
    assert loop_until(env, manager, 1, "mutex-trigger-register-feedback") == [("FAIL", "news")]
    assert all("cannot be reached" in text for text in problems(log))
    manager.close()
    memory.close()
    store.close()


# --- helpers in CLIPS -------------------------------------------------------------------------------------


def test_facts_are_converted_to_documents_and_back(env, call):
    env.build("(deftemplate thing (slot a-b-c) (multislot many))")
    env.assert_string('(thing (a-b-c 5) (many x "y" 2))')
    document = env.eval("(do-for-fact ((?f thing)) TRUE (rm-structured-fact-to-bson ?f))")
    text = '{ "relation" : "thing", "a_b-c" : 5, "many" : [ "x", "y", 2 ] }'
    assert call("bson-tostring", document) == text
    env.assert_string("(plain a 1)")
    plain = env.eval("(do-for-fact ((?f plain)) TRUE (rm-ordered-fact-to-bson ?f))")
    assert call("bson-tostring", plain) == '{ "relation" : "plain", "values" : [ "a", 1 ] }'
    call("rm-assert-from-bson", call("bson-parse", '{"relation": "thing", "many": ["q", 3]}'))
    assert [slots["many"] for _, _, slots in env.facts("thing")][-1] == ("q", 3)
