"""Processes that are killed and stopped at random lose no acknowledged message and leave no stale writer."""

from __future__ import annotations

import os

import pytest

from benchmarks.nemesis_zmq import check_history, parse, payload, run
from tests.support import many


def test_killed_and_stopped_processes_lose_no_messages():
    seconds = float(os.environ.get("CXBRIDGE_NEMESIS_SECONDS", many(6, 2)))
    assert run(seconds, writers=2, readers=1, max_pause_s=0.6) == []


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
def test_faults_in_journals_are_detected(tmp_path, writer, fault):
    (tmp_path / "reader.7.log").write_text(READER)
    (tmp_path / "writer.8.log").write_text(writer)
    faults, counts = check_history(tmp_path)
    assert counts["acknowledged"] == 2
    assert [fault is not None and fault in found for found in faults] == ([] if fault is None else [True])


def test_mixed_payload_is_detected():
    first, second = payload(11, 41), payload(11, 42)
    assert parse(first) == (11, 41)
    assert parse(first[:450] + second[450:]) is None
