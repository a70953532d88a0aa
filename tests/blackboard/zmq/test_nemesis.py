"""Processes that are killed and stopped at random lose nothing acknowledged and leave no stale writer."""

from __future__ import annotations

import os

import pytest

from benchmarks.nemesis_zmq import check_history, parse, payload, run
from tests.support import many


def test_a_few_seconds_with_the_nemesis():
    seconds = float(os.environ.get("CXBRIDGE_NEMESIS_SECONDS", many(6, 2)))
    assert run(seconds, writers=2, readers=1, pause=0.6) == []


READER = "reads 5\nacknowledged 7 1\nacknowledged 7 2\n"


@pytest.mark.parametrize(
    ("writer", "fault"),
    [
        ("took 7 1\ntook 7 2\n", None),
        ("took 7 1\n", "acknowledged message 7 2 was lost"),
        ("took 7 1\nrefused\n", "acknowledged message 7 2 was lost"),
        ("took 7 1\ntook 7 2\ntook 7 2\n", "took 7 2 again"),
        ("took 7 2\ntook 7 1\n", "took 7 1 after 2"),
        ("took 7 1\ntook 7 2\nviolation torn\n", "violation torn"),
    ],
)
def test_what_the_journals_give_away(tmp_path, writer, fault):
    (tmp_path / "reader.7.log").write_text(READER)
    (tmp_path / "writer.8.log").write_text(writer)
    faults, counts = check_history(tmp_path)
    assert counts["acknowledged"] == 2
    assert [fault is not None and fault in found for found in faults] == ([] if fault is None else [True])


def test_a_torn_payload_is_found_out():
    one, other = payload(11, 41), payload(11, 42)
    assert parse(one) == (11, 41)
    assert parse(one[:450] + other[450:]) is None
