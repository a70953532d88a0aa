"""Memory does not grow with the goals that were, nor with the messages that went.

Objects are counted, not bytes of the process, which go up and down by more than a small leak.
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator, Sequence
from typing import Any

import pytest

from cxbridge.run.agent import Run
from tests import message_ids, soak_goals
from tests.support import many

GOALS = many(5000, 2200)
"""Caches have their length after a thousand."""

MESSAGES = many(20_000, 2000)
BLOCKS_EACH = 0.5
"""Python's blocks of memory that a goal or a message may leave behind: less than one object."""

MOST_CLIPS_BYTES = 64
"""CLIPS leaves no memory; the time fact's numbers have one size."""


def blocks() -> int:
    gc.collect()
    return sys.getallocatedblocks()


def growth(sizes: Sequence[float]) -> float:
    """Return the growth from the third to the last quarter of the sizes, without temporary peaks."""
    half, quarter = len(sizes) // 2, len(sizes) * 3 // 4
    return min(sizes[quarter:]) - min(sizes[half:quarter])


def allowed_growth(count: int, of_all: float = 1.0) -> float:
    """Return the number of blocks that goals or messages may leave from one quarter to the next.

    :param of_all: the measured part of the goals or messages.
    """
    return BLOCKS_EACH * count * of_all / 4


@pytest.fixture(autouse=True, scope="module")
def small_heap() -> Iterator[None]:
    """The collector visits only objects of this test, not all objects that earlier tests loaded."""
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()


@pytest.fixture
def short_memories(monkeypatch: Any) -> None:
    """Bounded lists of past objects reach their full length soon."""
    for name in ("cxbridge.executive.goals.MAX_GOALS", "cxbridge.executive.goals.MAX_ENDED_ROOTS"):
        monkeypatch.setattr(name, 20)


@pytest.mark.usefixtures("short_memories")
def test_finished_goals_leave_no_memory() -> None:
    clips: list[float] = []

    def gauge(run: Run) -> float:
        used = run.executive.env.eval("(mem-used)")
        assert isinstance(used, int)
        clips.append(used)
        return blocks()

    python = [used for _, used in soak_goals.measure(GOALS, gauge)]
    assert growth(python) <= allowed_growth(GOALS, 1 - soak_goals.WARM_UP), python
    assert growth(clips) <= MOST_CLIPS_BYTES, clips


@pytest.mark.parametrize("transport", message_ids.TRANSPORTS)
def test_sent_messages_leave_no_memory(transport: str) -> None:
    sizes, faults = message_ids.drive(transport, MESSAGES, blocks, batch=100)
    assert not faults
    assert growth(sizes) <= allowed_growth(MESSAGES), sizes
