"""The store in this process: its file, its clock, its threads."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.clock import VirtualClock
from cxbridge.executive.robmem.embedded import EmbeddedStore
from cxbridge.executive.robmem.errors import RobotMemoryError
from cxbridge.executive.robmem.query import compile_query
from cxbridge.executive.robmem.values import Document

C = "robmem.test"


def test_a_file_survives(clock, tmp_path):
    file = tmp_path / "deep" / "memory.db"
    store = EmbeddedStore(clock, file)
    for number in range(5):
        store.insert(C, {"_id": number, "a": [number]})
    store.update(C, {"_id": 1}, {"a": "changed"})
    store.remove(C, {"_id": 2})
    store.insert("robmem.gone", {"_id": 1})
    store.drop("robmem.gone")
    expected = store.find(C)
    store.close()
    again = EmbeddedStore(clock, file)
    assert again.find(C) == expected
    assert again.collections() == [C]
    again.close()


def test_a_process_that_is_killed_leaves_what_it_wrote(clock, tmp_path):
    file = tmp_path / "memory.db"
    program = (
        "import os, sys, pathlib; from cxbridge.clock import RealClock;"
        "from cxbridge.executive.robmem.embedded import EmbeddedStore;"
        "store = EmbeddedStore(RealClock(), pathlib.Path(sys.argv[1]));"
        "[store.insert('robmem.test', {'_id': n}) for n in range(100)];"
        "os.kill(os.getpid(), 9)"
    )
    done = subprocess.run([sys.executable, "-c", program, str(file)], check=False)
    assert done.returncode == -9
    store = EmbeddedStore(clock, file)
    assert [document["_id"] for document in store.find(C)] == list(range(100))
    store.close()


def test_one_file_is_for_one_process(clock, tmp_path):
    file = tmp_path / "memory.db"
    store = EmbeddedStore(clock, file)
    with pytest.raises(RobotMemoryError, match=r"(?s)memory\.db: .*another process has it"):
        EmbeddedStore(clock, file)
    store.close()


def test_somebody_elses_file_is_left_alone(clock, tmp_path):
    file = tmp_path / "other.db"
    other = sqlite3.connect(file)
    other.execute("CREATE TABLE theirs (a)")
    other.commit()
    other.close()
    with pytest.raises(RobotMemoryError, match="not a robot memory"):
        EmbeddedStore(clock, file)
    text = tmp_path / "text.txt"
    text.write_text("a letter to my aunt, of more than a few characters" * 20)
    with pytest.raises(RobotMemoryError, match="cannot keep the robot memory here"):
        EmbeddedStore(clock, text)
    assert text.read_text().startswith("a letter")


def test_runs_on_a_virtual_clock_repeat():
    def run():
        clock = VirtualClock()
        store = EmbeddedStore(clock)
        told: list[Document] = []
        store.watch(C, {}, told.append)
        store.insert(C, {"a": 1})
        clock.sleep_until(clock.now_us() + 5_000_000)
        store.update(C, {}, {"$currentDate": {"t": True}})
        return told

    assert run() == run()


def test_documents_whose_time_is_over_go(clock):
    store = EmbeddedStore(clock)
    store.create_index(C, {"t": 1}, expire_after_s=10)
    for name in ("old", "young"):
        store.update(C, {"_id": name}, {"$currentDate": {"t": True}}, upsert=True)
        store.attend()
        clock.sleep_until(clock.now_us() + 55_000_000)
    store.insert(C, {"_id": "timeless", "t": "soon"})
    told: list[Document] = []
    store.watch(C, {}, told.append)
    store.attend()
    assert {document["_id"] for document in store.find(C)} == {"timeless"}
    assert [event["operationType"] for event in told] == ["delete", "delete"]


def test_many_threads_lose_nothing(clock):
    store = EmbeddedStore(clock)
    told: list[Document] = []
    store.insert(C, {"_id": "n", "n": 0})
    store.watch(C, {}, told.append)

    def count():
        for _ in range(200):
            store.update(C, {"_id": "n"}, {"$inc": {"n": 1}})

    threads = [threading.Thread(target=count) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert store.find(C) == [{"_id": "n", "n": 800}]
    assert [event["fullDocument"]["n"] for event in told] == list(range(1, 801))


SCALARS = st.none() | st.booleans() | st.integers(-3, 3) | st.sampled_from([0.5, 1.0, "a", "b", ""])
VALUES = SCALARS | st.lists(SCALARS, max_size=2) | st.dictionaries(st.sampled_from("xy"), SCALARS, max_size=2)
CONTENTS = st.dictionaries(st.sampled_from("ab"), VALUES, max_size=2)


@given(
    st.lists(st.tuples(st.integers(0, 60), CONTENTS), max_size=120),
    st.dictionaries(st.sampled_from(["a", "b", "a.x"]), VALUES, min_size=1, max_size=2),
)
def test_what_is_looked_up_is_what_would_be_found_by_looking_through(writes, query):
    store = EmbeddedStore(VirtualClock())
    for number in range(40):
        store.insert(C, {"_id": f"padding{number}"})
    store.find(C, query)  # makes the indexes, so that the writes must keep them
    for number, fields in writes:
        if fields:
            store.update(C, {"_id": number}, fields, upsert=True)
        else:
            store.remove(C, {"_id": number})
    fits = compile_query(query)
    expected = [document["_id"] for document in store.find(C) if fits(document)]
    assert sorted(map(str, expected)) == sorted(str(document["_id"]) for document in store.find(C, query))
