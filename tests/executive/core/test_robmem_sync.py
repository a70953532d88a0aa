"""The built-in core shares world model facts with other robots, and mirrors the domain, in the robot memory.

The tables are those of the compatibility page on the behaviour of the CX core, sections 8.4 and 8.6.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.executive.host.values import Symbol
from tests.executive.fake_robot_memory import Date, Document, MemoryBench

SHARED_FACTS = "syncedrobmem.worldmodel"
TRIGGER = "wm-robmem-sync-trigger"
FILES = (
    "plan.clp",
    "goal.clp",
    "domain.clp",
    "worldmodel.clp",
    "cx-identity.clp",
    "robot-memory.clp",
    "wm-robmem-sync.clp",
)


class RobmemBench(MemoryBench):
    """A robot that shares the facts below ``/shared``.

    :param me: identity of the robot; empty for none.
    """

    def __init__(self, me: str = "me") -> None:
        super().__init__(*FILES)
        if me:
            self.env.call("cx-identity-set", me)
        self.env.assert_string("(executive-init)")
        self.env.call("wm-robmem-sync-enable", "/shared")
        self.settle()

    def settle(self, seconds: float = 1.0) -> None:
        """Let time pass, and run until the robot memory has delivered everything."""
        self.clock.time_us += round(seconds * 1_000_000)
        super().settle()

    def wm(self, fact_id: str, slots: str) -> None:
        """Assert a wm-fact and settle."""
        self.env.assert_string(f'(wm-fact (id "{fact_id}") {slots})')
        self.settle()

    def documents(self) -> dict[str, Document]:
        """Return the shared documents by ID."""
        return self.memory.collections.get(SHARED_FACTS, {})

    def now(self) -> int:
        """Return the time in milliseconds."""
        return self.clock.now_us() // 1000

    def receive(self, kind: str, fact_id: str, ms: int, **fields: object) -> None:
        """Deliver an event for a document that a robot wrote, or deleted, at a time."""
        event: Document = {"operationType": kind, "documentKey": {"_id": fact_id}, "clusterTime": Date(ms)}
        if kind != "delete":
            document = {"type": "INT", "is-list": "FALSE", "value": 1, "source": "other", **fields}
            document |= {"_id": fact_id, "update-timestamp": Date(ms)}
            event["fullDocument"] = {name: value for name, value in document.items() if value is not None}
        self.memory.trigger(TRIGGER, event)
        self.env.run()

    def value(self, fact_id: str) -> object:
        """Return the value of a wm-fact."""
        return self.one("wm-fact", id=fact_id)["value"]

    def stamp(self, fact_id: str) -> object:
        """Return the time of the last change of a fact, in milliseconds."""
        stamp = self.one("wm-robmem-sync-map-entry", wm_fact_id=fact_id)["update-timestamp"]
        assert isinstance(stamp, tuple)
        sec, usec = (int(part) for part in stamp)
        return sec * 1000 + usec // 1000

    def known(self) -> set[str]:
        """Return the IDs of all wm-facts but the identity."""
        return {str(fact["id"]) for fact in self.all("wm-fact")} - {"/cx/identity"}


@pytest.fixture
def bench() -> RobmemBench:
    return RobmemBench()


# --- to the robot memory ----------------------------------------------------------------------------------


def test_facts_without_identity_are_not_written() -> None:
    bench = RobmemBench("")
    bench.wm("/shared/x", "(value 1)")
    assert bench.documents() == {}
    assert bench.texts("W") == [
        "*** /cx/identity is not set in world model, will not sync until it is set! ***"
    ]
    bench.env.call("cx-identity-set", "me")
    bench.settle()
    assert set(bench.documents()) == {"/shared/x"}


_SET = '(deffunction set-x (?v) (do-for-fact ((?f wm-fact)) (eq ?f:id "/shared/x") (modify ?f (value ?v))))'


@pytest.mark.parametrize("modifier", ["agent", "core"])
def test_modified_fact_is_written_again(bench: RobmemBench, modifier: str, tmp_path: Path) -> None:
    if modifier == "agent":
        agent = tmp_path / "agent.clp"
        agent.write_text(_SET)
        bench.env.load(agent)
    else:
        bench.env.build(_SET)
    bench.wm("/shared/x", "(type INT) (value 1)")
    for value in (2, 3):
        bench.env.call("set-x", value)
        bench.settle()
        document = bench.documents()["/shared/x"]
        assert (document["value"], document["update-timestamp"]) == (value, Date(bench.now()))
    assert len(bench.memory.called("robmem-upsert")) == 3


def test_later_documents_are_not_overwritten(bench: RobmemBench) -> None:
    later = {
        "_id": "/shared/x",
        "source": "other",
        "update-timestamp": Date(bench.now() + 99_000),
        "value": 9,
    }
    bench.memory.collections[SHARED_FACTS] = {"/shared/x": later}
    bench.wm("/shared/x", "(value 1)")
    assert bench.documents()["/shared/x"] == later


# --- from the robot memory --------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["insert", "update"])
def test_only_later_documents_change_fact(bench: RobmemBench, kind: str) -> None:
    bench.wm("/shared/x", "(type INT) (value 1)")
    bench.receive(kind, "/shared/x", bench.now() - 1, value=2)
    assert bench.value("/shared/x") == 1
    assert bench.texts("W") == [
        "wm-robmem-sync-update: received update for /shared/x with older data than our own"
    ]
    bench.receive(kind, "/shared/x", bench.now() + 1, value=3)
    assert bench.value("/shared/x") == 3
    assert bench.stamp("/shared/x") == bench.now() + 1


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"type": "BOOL", "value": "TRUE"}, {"value": Symbol("TRUE")}),
        ({"type": "STRING", "value": "a b"}, {"value": "a b"}),
        ({"type": "FLOAT", "value": 1.5}, {"value": 1.5}),
        (
            {"type": "SYMBOL", "is-list": "TRUE", "values": ["a", "b"], "value": None},
            {"is-list": Symbol("TRUE"), "values": (Symbol("a"), Symbol("b")), "value": Symbol("nil")},
        ),
        ({"type": "INT", "is-list": "TRUE", "values": [1, 2], "value": None}, {"values": (1, 2)}),
    ],
)
def test_types_of_received_values(bench: RobmemBench, fields: Document, expected: Document) -> None:
    bench.receive("insert", "/shared/x", bench.now(), **fields)
    fact = bench.one("wm-fact", id="/shared/x")
    for slot, value in expected.items():
        assert (type(fact[slot]), fact[slot]) == (type(value), value)


NO_FACT = [
    {"type": None},
    {"type": 5},
    {"type": "NONSENSE"},
    {"type": {"a": 1}},
    {"value": None},
    {"value": {"a": 1}},
    {"value": [1]},
    {"is-list": "MAYBE"},
    {"is-list": "TRUE"},
    {"is-list": "TRUE", "values": 5},
    {"is-list": "TRUE", "values": [1, {"a": 1}]},
]


@pytest.mark.parametrize("fields", NO_FACT, ids=repr)
def test_invalid_document_is_ignored(bench: RobmemBench, fields: Document) -> None:
    bench.receive("insert", "/shared/x", bench.now(), **fields)
    assert bench.texts("E") == ["The document /shared/x is not a wm-fact, it is ignored"]
    assert bench.known() == set()
    assert bench.memory.living() == 0
    bench.receive("insert", "/shared/x", bench.now())
    assert bench.known() == {"/shared/x"}


@pytest.mark.parametrize("fields", NO_FACT, ids=repr)
def test_restore_skips_invalid_documents(bench: RobmemBench, fields: Document) -> None:
    fine = {"type": "INT", "is-list": "FALSE", "value": 1, "source": "other", "update-timestamp": Date(1)}
    bad = {name: value for name, value in {**fine, **fields}.items() if value is not None}
    bench.memory.collections[SHARED_FACTS] = {
        "/shared/a": {**bad, "_id": "/shared/a"},
        "/shared/b": {**fine, "_id": "/shared/b"},
    }
    bench.env.call("wm-robmem-sync-restore")
    assert bench.known() == {"/shared/b"}
    assert bench.texts("E") == ["The document /shared/a is not a wm-fact, it is ignored"]


@pytest.mark.parametrize(
    "event",
    [
        {},
        {"operationType": 5},
        {"operationType": "insert"},
        {"operationType": "insert", "documentKey": {"_id": "/shared/x"}, "fullDocument": 5},
        {"operationType": "insert", "fullDocument": {"_id": 5, "source": "other"}},
        {"operationType": "delete", "documentKey": 7},
    ],
    ids=repr,
)
def test_invalid_event_is_ignored(bench: RobmemBench, event: Document) -> None:
    bench.memory.trigger(TRIGGER, event)
    bench.env.run()
    assert bench.known() == set()
    assert bench.all("robmem-trigger") == bench.all("wm-robmem-sync-map-entry") == []
    assert bench.memory.living() == 0


def test_deletion_needs_later_timestamp(bench: RobmemBench) -> None:
    bench.wm("/shared/x", "(value 1)")
    bench.receive("delete", "/shared/x", bench.now() - 1)
    assert bench.known() == {"/shared/x"}
    assert bench.texts("W") == [
        "wm-robmem-sync-delete: received delete for /shared/x with older timetamp than our own"
    ]
    bench.receive("delete", "/shared/x", bench.now() + 5)
    assert bench.known() == set()
    assert bench.one("wm-robmem-sync-map-entry")["wm-fact-idx"] == 0
    assert bench.stamp("/shared/x") == bench.now() + 5


# --- start, restore, end ----------------------------------------------------------------------------------


def test_failed_registration_is_repeated(bench: RobmemBench) -> None:
    bench.env.eval("(do-for-fact ((?i wm-robmem-sync-initialized)) TRUE (retract ?i))")
    bench.memory.refuse_triggers = 1
    bench.settle()
    assert bench.texts("W") == [f"Failed to register trigger '{TRIGGER}', retrying"]
    assert len(bench.all("wm-robmem-sync-initialized")) == 1
