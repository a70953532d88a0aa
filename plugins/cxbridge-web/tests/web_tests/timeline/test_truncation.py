"""Bounded lists know what they left out."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cxbridge_web.timeline.truncation import TruncatedList


@given(st.integers(0, 40), st.integers(1, 20))
def test_the_first_and_the_last_stay(count, limit):
    kept = TruncatedList[int](limit)
    for number in range(count):
        kept.add(number)
    items = kept.items()
    assert kept.total == count
    assert len(items) == min(count, limit)
    assert kept.lost == count - len(items)
    assert items == sorted(items)
    if count:
        assert items[-1] == count - 1
    if kept.gap is None:
        assert items == list(range(count))
    else:
        assert items[: kept.gap] == list(range(kept.gap))
        assert items[kept.gap] == kept.gap + kept.lost
