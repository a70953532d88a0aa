"""The effects of a replay on a blackboard, equal for all transports."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from cxbridge.errors import BlackBoardError, TraceError
from cxbridge.trace.replay.pace import Pace
from cxbridge.trace.replay.player import ReplayPlayer
from cxbridge.trace.replay.replayed_writes import ReplaySelection, replayed_writes, survey_replay
from tests.trace.boards import TRANSPORTS, Site, until
from tests.trace.replay.samples import BEGIN_US, UID, WriteListener, recorded, write

OTHER = "SwitchInterface::t"


@pytest.fixture(params=TRANSPORTS)
def site(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Site]:
    with Site(request.param, tmp_path) as site:
        yield site


@contextmanager
def opened(site: Site, run: Any, selection: ReplaySelection) -> Iterator[ReplayPlayer]:
    """Yield a player with open interfaces."""
    board = site.connect()
    player = ReplayPlayer(board)
    try:
        player.open(survey_replay(run, selection))
        yield player
        if site.transport != "local":
            board.flush()
    finally:
        player.close()
        if board is not site.board:
            board.shutdown()


def play(site: Site, run: Any, selection: ReplaySelection | None = None) -> ReplayPlayer:
    """Play a run without pauses."""
    chosen = selection or ReplaySelection()
    with opened(site, run, chosen) as player:
        assert player.play(replayed_writes(run, chosen), Pace(1e9, threading.Event(), lambda: None))
        return player


def test_each_write_has_recorded_stamp(site: Site, tmp_path: Path) -> None:
    listener = WriteListener(site.board)
    player = play(site, recorded(tmp_path, *(write(ms, ms) for ms in range(1, 51))))
    until(lambda: len(listener.writes) == 50)
    assert listener.writes == [(ms, BEGIN_US + ms * 1000) for ms in range(1, 51)]
    assert player.write_counts == {UID: 50}


def test_interfaces_are_open_before_first_write_and_closed_at_end(site: Site, tmp_path: Path) -> None:
    run = recorded(tmp_path, write(1, 1), write(2, 2, OTHER))
    with opened(site, run, ReplaySelection()):
        infos = {info.uid: info for info in site.board.list("SwitchInterface")}
        assert infos.keys() == {UID, OTHER}
        assert all(info.has_writer and info.timestamp_us == 0 for info in infos.values())
    until(lambda: not site.board.list("SwitchInterface"))


def test_existing_writer_is_error(site: Site, tmp_path: Path) -> None:
    site.board.open_for_writing("SwitchInterface", "t", owner="the robot")
    run = recorded(tmp_path, write(1, 1), write(2, 2, OTHER))
    with pytest.raises(BlackBoardError, match="SwitchInterface::t cannot be replayed: it has a writer"):
        play(site, run)
    until(lambda: [info.uid for info in site.board.list("SwitchInterface")] == [OTHER])


def test_other_definition_on_server_is_refused(site: Site, tmp_path: Path) -> None:
    if site.transport == "local":
        pytest.skip("a blackboard in this process has one definition of a type")
    folder = tmp_path / "old"
    folder.mkdir()
    (folder / "SwitchInterface.xml").write_text(
        '<!DOCTYPE interface SYSTEM "interface.dtd"><interface name="SwitchInterface">'
        '<data><comment>c</comment><field type="int32" name="number">c</field></data></interface>'
    )
    with Site(site.transport, folder, folder) as other_site:
        other_site.board.open_for_reading("SwitchInterface", "s", owner="old")
        with pytest.raises(BlackBoardError):
            play(other_site, recorded(tmp_path, write(1, 1)))


def test_only_changed_data_raise_changed_event(tmp_path: Path) -> None:
    with Site("local", tmp_path) as site:
        listener = WriteListener(site.board)
        play(site, recorded(tmp_path, write(1, 1), write(2, 1), write(3, 2), write(4, 2)))
        assert (len(listener.writes), listener.changes) == (4, 2)


def test_later_write_that_does_not_fit_is_error(tmp_path: Path) -> None:
    with (
        Site("local", tmp_path) as site,
        pytest.raises(TraceError, match="only the recording has extra"),
    ):
        play(site, recorded(tmp_path, write(1, 1), write(2, 2, extra=1)))
