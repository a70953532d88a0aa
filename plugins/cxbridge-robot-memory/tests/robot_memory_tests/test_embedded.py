"""The embedded store: its file, its clock, its threads."""

from __future__ import annotations

import contextlib
import random
import sqlite3
import subprocess
import sys
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.clock import VirtualClock
from cxbridge_robot_memory.embedded import EmbeddedStore
from cxbridge_robot_memory.errors import RobotMemoryError
from cxbridge_robot_memory.query import compile_query
from cxbridge_robot_memory.values import Document
from tests.support import ROOT

C = "robmem.test"


WRITER = """
import itertools, os, pathlib, sys, threading
from cxbridge.clock import RealClock
from cxbridge_robot_memory.embedded import EmbeddedStore
store = EmbeddedStore(RealClock(), pathlib.Path(sys.argv[1]))
def write(name):
    for number in itertools.count():
        store.insert("robmem.test", {"_id": f"{name}{number}"})
        store.update("robmem.test", {"_id": name}, {"$inc": {"n": 1}}, upsert=True)
        os.write(1, f"{name} {number}\\n".encode())
threads = [threading.Thread(target=write, args=(name,)) for name in "ab"]
for thread in threads:
    thread.start()
"""


@pytest.mark.parametrize("answers", [1, 7, 60, 300])
def test_acknowledged_writes_survive_kill_at_any_time(clock, tmp_path, answers):
    file = tmp_path / "memory.db"
    with subprocess.Popen(
        [sys.executable, "-c", WRITER, str(file)], stdout=subprocess.PIPE, text=True, cwd=ROOT
    ) as writer:
        assert writer.stdout is not None
        lines = [writer.stdout.readline() for _ in range(answers)]
        writer.kill()
        lines += writer.stdout.read().splitlines(keepends=True)
    store = EmbeddedStore(clock, file)
    documents = {document["_id"]: document for document in store.find(C)}
    acknowledged = [line.split() for line in lines if line.endswith("\n")]
    assert len(acknowledged) >= answers
    for name, number in acknowledged:
        assert f"{name}{number}" in documents
        assert documents[name]["n"] > int(number)
    store.close()


FULL = """
import pathlib, resource, signal, sys
from cxbridge.clock import RealClock
from cxbridge_robot_memory.embedded import EmbeddedStore
from cxbridge_robot_memory.errors import RobotMemoryError
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
store = EmbeddedStore(RealClock(), pathlib.Path(sys.argv[1]))
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, resource.RLIM_INFINITY))
done = 0
try:
    while True:
        store.insert("robmem.test", {"_id": done, "text": "x" * 1000})
        done += 1
except RobotMemoryError as error:
    assert "cannot write the robot memory" in str(error), error
    assert sys.argv[1] in str(error), error
assert len(store.find("robmem.test")) == done  # refused documents are absent
resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
store.insert("robmem.test", {"_id": "after"})
print(done)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no limits of file sizes")
def test_full_disk_loses_no_acknowledged_write(clock, tmp_path):
    file = tmp_path / "memory.db"
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(file)], capture_output=True, text=True, check=False, cwd=ROOT
    )
    assert done.returncode == 0, done.stderr
    store = EmbeddedStore(clock, file)
    assert [document["_id"] for document in store.find(C)] == [*range(int(done.stdout)), "after"]
    store.close()


def damage(data: bytes, kind: int, chance: random.Random) -> bytes:
    """Return a copy of the data with one of four kinds of damage."""
    changed = bytearray(data)
    at = chance.randrange(len(changed))
    if kind == 0:
        for _ in range(20):
            changed[chance.randrange(len(changed))] = chance.randrange(256)
    elif kind == 1:
        del changed[at:]
    elif kind == 2:
        changed[at : at + 500] = bytes(len(changed[at : at + 500]))
    else:
        changed[chance.randrange(100)] = chance.randrange(256)
    return bytes(changed)


def test_damaged_file_is_error_with_its_name(clock, tmp_path):
    file = tmp_path / "memory.db"
    store = EmbeddedStore(clock, file)
    for number in range(200):
        store.insert(C, {"_id": number, "a": number, "text": "x" * 50, "l": [1, {"b": number}]})
    store.close()
    good, chance = file.read_bytes(), random.Random(5)
    errors: dict[str, str | None] = {}
    for number in range(80):
        bad = tmp_path / f"bad{number}.db"
        bad.write_bytes(damage(good, number % 4, chance))
        with contextlib.suppress(RobotMemoryError):  # only RobotMemoryError is accepted
            try:
                reopened = EmbeddedStore(clock, bad)
                reopened.update(C, {}, {"z": 1})
                reopened.close()
            except RobotMemoryError as error:
                errors[str(bad)] = error.file
                raise
    assert len(errors) > 40
    assert [*errors] == [*errors.values()]


def test_file_of_another_version_is_refused_unchanged(clock, tmp_path):
    file = tmp_path / "memory.db"
    EmbeddedStore(clock, file).close()
    with sqlite3.connect(file) as database:
        database.execute("PRAGMA user_version = 0")
    database.close()
    before = file.read_bytes()
    with pytest.raises(RobotMemoryError, match="not a robot memory of this version of cxbridge"):
        EmbeddedStore(clock, file)
    assert file.read_bytes() == before


def test_file_is_locked_for_one_process(clock, tmp_path):
    file = tmp_path / "memory.db"
    store = EmbeddedStore(clock, file)
    with pytest.raises(RobotMemoryError, match=r"(?s)memory\.db: .*another process has the file"):
        EmbeddedStore(clock, file)
    store.close()


def test_file_of_another_program_is_refused_unchanged(clock, tmp_path):
    file = tmp_path / "other.db"
    foreign = sqlite3.connect(file)
    foreign.execute("CREATE TABLE theirs (a)")
    foreign.commit()
    foreign.close()
    with pytest.raises(RobotMemoryError, match="not a robot memory"):
        EmbeddedStore(clock, file)
    text = tmp_path / "text.txt"
    text.write_text("a letter with more than a few characters, " * 20)
    with pytest.raises(RobotMemoryError, match="cannot open the robot memory"):
        EmbeddedStore(clock, text)
    assert text.read_text().startswith("a letter")


def test_events_on_virtual_clock_repeat():
    def run():
        clock = VirtualClock()
        store = EmbeddedStore(clock)
        events: list[Document] = []
        store.watch(C, {}, events.append)
        store.insert(C, {"a": 1})
        clock.sleep_until(clock.now_us() + 5_000_000)
        store.update(C, {}, {"$currentDate": {"t": True}})
        return events

    assert run() == run()


def test_concurrent_updates_are_all_applied(clock):
    store = EmbeddedStore(clock)
    events: list[Document] = []
    store.insert(C, {"_id": "n", "n": 0})
    store.watch(C, {}, events.append)

    def count():
        for _ in range(200):
            store.update(C, {"_id": "n"}, {"$inc": {"n": 1}})

    threads = [threading.Thread(target=count) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert store.find(C) == [{"_id": "n", "n": 800}]
    assert [event["fullDocument"]["n"] for event in events] == list(range(1, 801))


SCALARS = st.none() | st.booleans() | st.integers(-3, 3) | st.sampled_from([0.5, 1.0, "a", "b", ""])
VALUES = SCALARS | st.lists(SCALARS, max_size=2) | st.dictionaries(st.sampled_from("xy"), SCALARS, max_size=2)
CONTENTS = st.dictionaries(st.sampled_from("ab"), VALUES, max_size=2)


@given(
    st.lists(st.tuples(st.integers(0, 60), CONTENTS), max_size=120),
    st.dictionaries(st.sampled_from(["a", "b", "a.x"]), VALUES, min_size=1, max_size=2),
)
def test_indexed_query_equals_full_scan(writes, query):
    store = EmbeddedStore(VirtualClock())
    for number in range(40):
        store.insert(C, {"_id": f"padding{number}"})
    store.find(C, query)  # creates the indexes, which the writes must update
    for number, fields in writes:
        if fields:
            store.update(C, {"_id": number}, fields, upsert=True)
        else:
            store.remove(C, {"_id": number})
    matches = compile_query(query)
    expected = [document["_id"] for document in store.find(C) if matches(document)]
    assert sorted(map(str, expected)) == sorted(str(document["_id"]) for document in store.find(C, query))
    # unused values leave no keys
    indexes = store._collections[C]._indexes.values()
    assert all(identities for index in indexes for identities in index.values())
