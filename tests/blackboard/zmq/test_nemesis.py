"""Processes that are killed and stopped at random lose nothing acknowledged and leave no stale writer."""

from __future__ import annotations

import os

from benchmarks.nemesis_zmq import run


def test_a_few_seconds_with_the_nemesis():
    assert run(float(os.environ.get("CXBRIDGE_NEMESIS_SECONDS", "6")), writers=2, readers=1, pause=0.6) == []
