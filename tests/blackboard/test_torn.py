"""Reads are complete and in order, in threads and in processes over ZeroMQ."""

from __future__ import annotations

import os

import pytest

from tests.blackboard.torn_reads import find_write_number, make_block, read_in_processes, read_in_threads

READS = int(os.environ.get("CXBRIDGE_READS", "4000"))


@pytest.mark.parametrize("read", [read_in_threads, read_in_processes])
def test_reads_are_complete_and_in_order(read):
    tally = read(READS)
    assert tally.reads >= READS
    assert not tally.faults


def test_mixed_blocks_are_detected():
    first, second = make_block(70_000), make_block(70_001)
    assert find_write_number(first) == 70_000
    for cut in range(1, len(first)):
        mix = first[:cut] + second[cut:]
        if mix not in (first, second):
            assert find_write_number(mix) is None
    assert find_write_number(first[:16] + first[20:] + first[16:20]) is None
