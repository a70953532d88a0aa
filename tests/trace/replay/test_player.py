"""What a replay does to a blackboard, the same on every transport."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from cxbridge.blackboard.patterns import Pattern
from cxbridge.clock import RealClock
from cxbridge.errors import BlackBoardError, TraceError
from cxbridge.events import EventBus
from cxbridge.trace.replay.moves import ReplaySelection, replay_moves, survey_replay
from cxbridge.trace.replay.pace import Pace
from cxbridge.trace.replay.player import OWNER, ReplayPlayer
from tests.trace.boards import TRANSPORTS, Site, until
from tests.trace.replay.samples import BEGIN_US, UID, Ear, message, recorded, write

OTHER = "SwitchInterface::t"


@pytest.fixture(params=TRANSPORTS)
def site(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Site]:
    with Site(request.param, tmp_path) as site:
        yield site


@contextmanager
def opened(
    site: Site, run: Any, selection: ReplaySelection, *, restamp: bool = False
) -> Iterator[ReplayPlayer]:
    """A player that has its interfaces open."""
    board = site.connect()
    player = ReplayPlayer(board, EventBus(RealClock()).logger("test"), restamp=restamp)
    try:
        player.open(survey_replay(run, selection))
        yield player
        if site.transport != "local":
            board.flush()
    finally:
        player.close()
        if board is not site.board:
            board.shutdown()


def play(
    site: Site, run: Any, selection: ReplaySelection | None = None, *, restamp: bool = False
) -> ReplayPlayer:
    """Play all of a run at once."""
    chosen = selection or ReplaySelection()
    with opened(site, run, chosen, restamp=restamp) as player:
        assert player.play(replay_moves(run, chosen), Pace(1e9, threading.Event(), lambda: None))
        return player


def test_each_write_comes_with_its_recorded_stamp(site: Site, tmp_path: Path) -> None:
    ear = Ear(site.board)
    player = play(site, recorded(tmp_path, *(write(ms, ms) for ms in range(1, 51))))
    until(lambda: len(ear.heard) == 50)
    assert ear.heard == [(ms, BEGIN_US + ms * 1000) for ms in range(1, 51)]
    assert player.write_counts == {UID: 50}


def test_restamped_writes_have_the_time_of_the_replay(site: Site, tmp_path: Path) -> None:
    ear = Ear(site.board)
    before_us = RealClock().now_us() - 1_000_000
    play(site, recorded(tmp_path, write(1, 1), write(2, 2)), restamp=True)
    until(lambda: len(ear.heard) == 2)
    assert ear.values == [1, 2]
    assert all(stamp_us >= before_us for _, stamp_us in ear.heard)


def test_all_are_open_before_the_first_write_and_closed_at_the_end(site: Site, tmp_path: Path) -> None:
    run = recorded(tmp_path, write(1, 1), write(2, 2, OTHER))
    with opened(site, run, ReplaySelection()):
        infos = {info.uid: info for info in site.board.list("SwitchInterface")}
        assert infos.keys() == {UID, OTHER}
        assert all(info.has_writer and info.timestamp_us == 0 for info in infos.values())
    until(lambda: not site.board.list("SwitchInterface"))


def test_a_writer_that_exists_is_one_clear_error(site: Site, tmp_path: Path) -> None:
    site.board.open_for_writing("SwitchInterface", "t", owner="the robot")
    run = recorded(tmp_path, write(1, 1), write(2, 2, OTHER))
    with pytest.raises(BlackBoardError, match="SwitchInterface::t cannot be replayed: it has a writer"):
        play(site, run)
    until(lambda: [info.uid for info in site.board.list("SwitchInterface")] == [OTHER])


def test_another_definition_at_the_other_end_is_refused(site: Site, tmp_path: Path) -> None:
    if site.transport == "local":
        pytest.skip("a blackboard in this process has one definition of a type")
    folder = tmp_path / "old"
    folder.mkdir()
    (folder / "SwitchInterface.xml").write_text(
        '<!DOCTYPE interface SYSTEM "interface.dtd"><interface name="SwitchInterface">'
        '<data><comment>c</comment><field type="int32" name="number">c</field></data></interface>'
    )
    with Site(site.transport, folder, folder) as other:
        other.board.open_for_reading("SwitchInterface", "s", owner="old")
        with pytest.raises(BlackBoardError):
            play(other, recorded(tmp_path, write(1, 1)))


def test_messages_go_to_the_writers_of_other_interfaces(site: Site, tmp_path: Path) -> None:
    run = recorded(
        tmp_path,
        write(1, 1),
        message(2, OTHER, enabled=True, value=0.5),
        message(3, UID, enabled=True, value=0.25),
        message(4, "SwitchInterface::nobody", kind="EnableSwitchMessage"),
    )
    writer: Any = site.board.open_for_writing("SwitchInterface", "t", owner="the robot")
    player = play(site, run, ReplaySelection((Pattern.parse("*::s"),), sends_messages=True))
    until(lambda: writer.msgq_size() == 1)
    taken: Any = writer.msgq_pop()
    assert (taken.type, taken.enabled, taken.value) == ("SetMessage", True, 0.5)
    assert player.sent_count + player.undelivered_count == 2
    assert player.undelivered_count == 1 or site.transport == "fawkes"  # which does not acknowledge messages


def test_messages_to_replayed_interfaces_are_dropped(tmp_path: Path) -> None:
    with (
        Site("local", tmp_path) as site,
        opened(site, recorded(tmp_path, write(1, 1)), ReplaySelection()) as player,
    ):
        reader = site.board.open_for_reading("SwitchInterface", "s")
        reader.msgq_enqueue(reader.create_message("EnableSwitchMessage"))
        player.drop_messages()
        writer = next(writer for writer, _ in player._writers.values())
        assert writer.msgq_empty()
        assert writer.owner == OWNER


def test_only_changed_data_raise_a_changed_event(tmp_path: Path) -> None:
    with Site("local", tmp_path) as site:
        ear = Ear(site.board)
        play(site, recorded(tmp_path, write(1, 1), write(2, 1), write(3, 2), write(4, 2)))
        assert (len(ear.heard), ear.changes) == (4, 2)


def test_a_later_write_that_does_not_fit_is_told(tmp_path: Path) -> None:
    with (
        Site("local", tmp_path) as site,
        pytest.raises(TraceError, match="only the recording has extra"),
    ):
        play(site, recorded(tmp_path, write(1, 1), write(2, 2, extra=1)))
