"""Processes that are killed and stopped at random lose nothing acknowledged and leave no stale writer."""

from __future__ import annotations

import os

import pytest

from benchmarks import nemesis_system
from benchmarks.nemesis_zmq import check_history, parse, payload, run
from tests.support import many


def test_a_few_seconds_with_the_nemesis():
    seconds = float(os.environ.get("CXBRIDGE_NEMESIS_SECONDS", many(6, 2)))
    assert run(seconds, writers=2, readers=1, pause=0.6) == []


def test_a_few_seconds_with_the_nemesis_of_gateway_recorder_and_executor():
    """What a caller takes for final was executed, whatever was killed; a thief's status passed for ours."""
    seconds = float(os.environ.get("CXBRIDGE_NEMESIS_SECONDS", many(10, 3)))
    assert nemesis_system.run(seconds) == []


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


SENT = "acknowledged 10\nacknowledged 20\nacknowledged 30\n"


@pytest.mark.parametrize(
    ("robot", "troupe", "faults", "excused"),
    [
        ("took 10\ntook 20\ntook 30\n", "", [], 0),
        ("took 10\ntook 30\n", "", ["acknowledged message 20 was lost between 10 and 30"], 0),
        (
            "took 10\ntook 30\n",
            "ended 5\nended 35\n",
            ["acknowledged message 20 was lost between 10 and 30"],
            0,
        ),
        ("took 10\ntook 30\n", "ended 15\n", [], 1),
        ("took 10\ntook 30\n", "ended 25\n", [], 1),
        ("took 20\ntook 30\n", "", ["acknowledged message 10 was lost between 0 and 20"], 0),
        ("took 10\ntook 20\n", "", [], 1),  # all were killed at the end
        ("took 10\ntook 20\ntook 20\ntook 30\n", "", ["message 20 was taken twice"], 0),
        ("took 20\ntook 10\ntook 30\n", "", ["a robot took messages out of order"], 0),
    ],
)
def test_what_the_journals_of_the_system_give_away(tmp_path, robot, troupe, faults, excused):
    skills = 'shows 1 S_FINAL say{text="1"}\n', 'got FINAL say{text="1"}\n', "succeeded 2\n", "worked 2\n"
    journals = {"robot": skills[0] + robot, "caller": skills[1], "daemon": skills[2], "worker": skills[3]}
    for name, text in {**journals, "sender": SENT, "troupe": troupe}.items():
        (tmp_path / f"{name}.7.log").write_text(text)
    history = nemesis_system.History(tmp_path)
    assert history.faults() == faults
    assert history.excused == excused
