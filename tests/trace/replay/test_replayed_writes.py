"""The events of a replay and their times, with all kinds of clocks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from cxbridge.events import InterfaceWrite
from cxbridge.trace.replay.replayed_writes import ReplaySelection, replayed_writes, survey_replay
from tests.trace.replay.samples import UID, recorded, write
from tests.trace.runs import MemoryRun


def times_and_values(run: Any, selection: ReplaySelection = ReplaySelection()) -> list[tuple[float, float]]:  # noqa: B008 - frozen
    """Return milliseconds and value of each write."""
    return [
        (position_us / 1000, event.values["value"])
        for position_us, event in replayed_writes(run, selection)
        if isinstance(event, InterfaceWrite)
    ]


def test_positions_are_relative_to_first_event(tmp_path: Path) -> None:
    run = recorded(tmp_path, write(100, 1), write(250, 2))
    assert times_and_values(run) == [(100, 1), (250, 2)]
    survey = survey_replay(run, ReplaySelection())
    assert survey.write_counts == {UID: 2}


def test_start_begins_with_values_of_interfaces(tmp_path: Path) -> None:
    uid = "SwitchInterface::t"
    run = recorded(tmp_path, write(0, 1), write(10, 2), write(20, 7, uid), write(2000, 3), write(3000, 4))
    assert times_and_values(run, ReplaySelection(start_s=1, end_s=2)) == [(1000, 2), (1000, 7), (2000, 3)]
    assert times_and_values(run, ReplaySelection(start_s=9)) == [(9000, 4), (9000, 7)]


def test_unordered_write_moves_no_other_write(tmp_path: Path) -> None:
    uid = "SwitchInterface::t"
    run = recorded(tmp_path, write(1000, 1), write(900, 2, uid), write(1001, 3), write(2000, 4))
    assert times_and_values(run) == [(1000, 1), (1000, 2), (1001, 3), (2000, 4)]


def test_no_time_passes_when_clock_is_set_back(tmp_path: Path) -> None:
    run = recorded(tmp_path, write(90_000, 1), write(1000, 2), write(1500, 3))
    assert times_and_values(run) == [(90_000, 1), (90_000, 2), (90_500, 3)]


def test_write_with_old_stamp_does_not_set_clock(tmp_path: Path) -> None:
    run = recorded(tmp_path, write(0, 1), write(5000, 2, "SwitchInterface::t"), write(0, 1), write(6000, 3))
    assert times_and_values(run) == [(0, 1), (5000, 2), (5000, 1), (6000, 3)]


@given(st.lists(st.tuples(st.sampled_from("ab"), st.integers(0, 10**10)), min_size=1))
def test_positions_never_decrease(times: list[tuple[str, int]]) -> None:
    run = MemoryRun(InterfaceWrite(time_us, f"Type::{name}", {}) for name, time_us in times)
    positions = [position_us for position_us, _ in replayed_writes(run, ReplaySelection())]
    assert positions == sorted(positions)
    assert len(positions) == len(times)
