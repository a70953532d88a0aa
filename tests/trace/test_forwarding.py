"""What a forwarder publishes of the writes on a blackboard, the same on every transport."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.patterns import Pattern
from cxbridge.clock import RealClock
from cxbridge.events import BlockWrite, Event, EventBus, InterfaceWrite, LogLine, SkillStatus
from cxbridge.interfaces import SwitchInterface
from cxbridge.trace.forwarding import WriteForwarder
from tests.trace.boards import REMOTE, TRANSPORTS, Site, until


class Forwarded:
    """A forwarder that a thread polls, and all that it has published."""

    def __init__(self, board: BlackBoard, *patterns: str) -> None:
        self.board = board
        self.out = EventBus(RealClock())
        self.published: list[Event] = []
        self.out.subscribe(self.published.append, BlockWrite, InterfaceWrite, SkillStatus, LogLine)
        self.forwarder = WriteForwarder(board, [Pattern.parse(text) for text in patterns], self.out)
        self.found = self.forwarder.start()
        self._stop = False
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while not self._stop:
            self.forwarder.poll(5)

    def close(self) -> None:
        self._stop = True
        self.forwarder.wake()
        self._thread.join()
        self.forwarder.close()

    def levels(self, uid: str = "SwitchInterface::s") -> list[float]:
        """The values of a switch that were published."""
        return [e.values["value"] for e in self.published if isinstance(e, InterfaceWrite) and e.uid == uid]

    def lines(self) -> list[str]:
        return [event.text for event in self.published if isinstance(event, LogLine)]

    def follows(self, uid: str) -> bool:
        return f"Recording {uid}" in self.lines()


@contextmanager
def forwarded(site: Site, *patterns: str) -> Iterator[Forwarded]:
    with ExitStack() as stack:
        board = site.connect()
        if board is not site.board:
            stack.callback(board.shutdown)
        made = Forwarded(board, *patterns)
        stack.callback(made.close)
        yield made


@pytest.fixture(params=TRANSPORTS)
def site(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Site]:
    with Site(request.param, tmp_path) as site:
        yield site


def write(writer: SwitchInterface, value: float) -> None:
    writer.value = value
    writer.write()


def test_every_write_is_told_once_in_order_with_its_own_stamp(site):
    writer = site.board.open_for_writing(SwitchInterface, "s")
    with forwarded(site, "SwitchInterface") as made:
        assert made.found == 1
        stamps = []
        for number in range(1, 101):
            write(writer, number)
            stamps.append(writer.timestamp_us)
        until(lambda: len(made.levels()) == 100)
    assert made.levels() == list(range(1, 101))
    writes = [event for event in made.published if isinstance(event, InterfaceWrite)]
    assert [event.time_us for event in writes] == stamps
    blocks = [event for event in made.published if isinstance(event, BlockWrite)]
    assert [event.uid for event in blocks] == ["SwitchInterface::s"] * 100
    assert blocks[-1].block == writer.to_bytes()
    assert made.forwarder.counts == {"SwitchInterface::s": 100}


def test_what_was_there_before_is_not_told(site):
    write(site.board.open_for_writing(SwitchInterface, "s"), 1)
    with forwarded(site, "SwitchInterface") as made:
        pass
    assert made.levels() == []


def test_a_write_while_the_listener_is_registered_is_told_once(tmp_path, monkeypatch):
    with Site("local", tmp_path) as site:
        writer, register = site.board.open_for_writing(SwitchInterface, "s"), site.board.register_listener

        def write_and_register(*arguments: Any) -> None:
            write(writer, 1)
            register(*arguments)

        monkeypatch.setattr(site.board, "reports_writes", False, raising=False)
        monkeypatch.setattr(site.board, "register_listener", write_and_register)
        with forwarded(site, "SwitchInterface") as made:
            (followed,) = made.forwarder._followed.values()
            made.forwarder.data_refreshed(followed.instance)  # the event of the first write comes late
            write(writer, 2)
    assert made.levels() == [1, 2]


def test_only_what_matches_is_told(site):
    writers = [site.board.open_for_writing(SwitchInterface, name) for name in ("ab", "ac", "b")]
    with forwarded(site, "SwitchInterface::a[!b]", "SwitchInterface::b") as made:
        for writer in writers:
            write(writer, 1)
        until(lambda: made.levels("SwitchInterface::ac") and made.levels("SwitchInterface::b"))
    assert sorted(made.forwarder.counts) == ["SwitchInterface::ac", "SwitchInterface::b"]


def test_an_interface_that_comes_later_is_told_with_what_it_holds_by_then(site):
    with forwarded(site, "SwitchInterface") as made:
        writer = site.board.open_for_writing(SwitchInterface, "s")
        write(writer, 1)
        until(lambda: made.follows("SwitchInterface::s"))
        write(writer, 2)
        until(lambda: made.levels()[-1:] == [2])
    assert made.levels() == [1, 2]


def test_an_interface_goes_when_only_the_recorder_has_it_and_may_come_again(site):
    with forwarded(site, "SwitchInterface") as made:
        for number in (1, 2):
            with site.board.open_for_writing(SwitchInterface, "s") as writer:
                until(lambda: made.lines().count("Recording SwitchInterface::s") == number)  # noqa: B023
                write(writer, number)
                until(lambda: made.levels()[-1:] == [number])  # noqa: B023
            until(lambda: not site.board.list("SwitchInterface"))
    assert made.levels() == [1, 2]


@pytest.mark.parametrize("transport", ["ipc", "tcp"])
def test_what_arrived_before_the_end_is_told(transport, tmp_path):
    with Site(transport, tmp_path) as site:
        writer = site.board.open_for_writing(SwitchInterface, "s")
        with forwarded(site, "SwitchInterface") as made:
            waiting = made.board._dispatcher._queue.qsize  # type: ignore[attr-defined]
            with made.forwarder._lock:  # its listener has to wait
                for number in range(1, 51):
                    write(writer, number)
                until(lambda: waiting() == 49)
        assert made.levels() == list(range(1, 51))


def test_a_stamp_that_is_no_time_is_replaced_by_the_time_of_arrival(site):
    writer = site.board.open_for_writing(SwitchInterface, "s")
    with forwarded(site, "SwitchInterface") as made:
        writer.auto_timestamping = False
        writer.set_timestamp(1 << 60)
        write(writer, 1)
        until(made.levels)
    (write_event,) = [event for event in made.published if isinstance(event, InterfaceWrite)]
    (block_event,) = [event for event in made.published if isinstance(event, BlockWrite)]
    assert write_event.time_us == block_event.time_us < 1 << 53


def test_while_it_is_switched_off_nothing_is_told(site):
    writer = site.board.open_for_writing(SwitchInterface, "s")
    with forwarded(site, "SwitchInterface") as made:
        reader = made.board.open_for_reading(SwitchInterface, "s")
        for number, enabled in enumerate((True, False, True), 1):
            made.forwarder.enabled = enabled
            write(writer, number)
            until(lambda: reader.read() and reader.value == number)  # noqa: B023
            made.board.flush()
    assert made.levels() == [1, 3]
    assert made.forwarder.counts == {"SwitchInterface::s": 2}


@pytest.mark.parametrize("transport", REMOTE)
def test_a_server_that_restarts_is_followed_and_the_gap_told_once(transport, tmp_path):
    with Site(transport, tmp_path) as site, forwarded(site, "SwitchInterface") as made:
        writer = site.board.open_for_writing(SwitchInterface, "s")
        until(lambda: made.follows("SwitchInterface::s"))
        write(writer, 1)
        until(lambda: made.levels() == [1])
        site.down()
        until(lambda: not made.board.connected)
        site.up()
        until(lambda: made.forwarder.gaps)
        write(site.board.open_for_writing(SwitchInterface, "s"), 2)
        write(site.board.open_for_writing(SwitchInterface, "new"), 3)
        until(lambda: made.levels() == [1, 2] and made.levels("SwitchInterface::new") == [3])
    assert len(made.forwarder.gaps) == 1
    assert made.forwarder.gaps[0].seconds > 0
    assert sum("A gap" in line for line in made.lines()) == 1
    assert not any("disappeared before" in line for line in made.lines())


@pytest.mark.parametrize("transport", REMOTE)
def test_a_server_that_does_not_come_back_is_a_gap_too(transport, tmp_path):
    with Site(transport, tmp_path) as site:
        with forwarded(site, "SwitchInterface") as made:
            site.down()
            until(lambda: not made.board.connected)
            until(lambda: made.forwarder._lost_since)
        site.up()
    assert len(made.forwarder.gaps) == 1


def test_a_type_that_we_do_not_know_is_told_once_and_the_others_are_recorded(tmp_path):
    (tmp_path / "OtherInterface.xml").write_text(
        '<interface name="OtherInterface" author="x" year="1"><data><comment>c</comment>'
        '<field name="a" type="int32">a</field></data></interface>'
    )
    with Site("ipc", tmp_path, tmp_path) as site:
        site.board.open_for_writing("OtherInterface", "o")
        writer = site.board.open_for_writing(SwitchInterface, "s")
        with forwarded(site, "*") as made:
            with site.board.open_for_reading("OtherInterface", "o"):
                pass
            write(writer, 1)
            until(made.levels)
        assert len([line for line in made.lines() if "cannot be recorded" in line]) == 1
