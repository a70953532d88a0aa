"""No read is a mix of two writes, or older than the one before: in threads, and in processes over ZeroMQ."""

from __future__ import annotations

import os

import pytest

from tests.blackboard.torn_reads import make_block, number_of, read_in_processes, read_in_threads

READS = int(os.environ.get("CXBRIDGE_READS", "4000"))


@pytest.mark.parametrize("read", [read_in_threads, read_in_processes])
def test_reads_are_whole_and_in_order(read):
    tally = read(READS)
    assert tally.reads >= READS
    assert not tally.faults


def test_what_is_torn_is_found_out():
    one, other = make_block(70_000), make_block(70_001)
    assert number_of(one) == 70_000
    for cut in range(1, len(one)):
        mix = one[:cut] + other[cut:]
        if mix not in (one, other):
            assert number_of(mix) is None
    assert number_of(one[:16] + one[20:] + one[16:20]) is None
