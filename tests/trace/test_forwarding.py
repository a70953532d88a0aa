"""The events that a forwarder publishes of the writes on a blackboard, equal for all transports."""

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


class PolledForwarder:
    """A forwarder with a polling thread, and its published events."""

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
        """Return the published values of a switch."""
        return [e.values["value"] for e in self.published if isinstance(e, InterfaceWrite) and e.uid == uid]

    def lines(self) -> list[str]:
        return [event.text for event in self.published if isinstance(event, LogLine)]

    def follows(self, uid: str) -> bool:
        return f"Recording {uid}" in self.lines()


@contextmanager
def forwarded(site: Site, *patterns: str) -> Iterator[PolledForwarder]:
    with ExitStack() as stack:
        board = site.connect()
        if board is not site.board:
            stack.callback(board.shutdown)
        forwarder = PolledForwarder(board, *patterns)
        stack.callback(forwarder.close)
        yield forwarder


@pytest.fixture(params=TRANSPORTS)
def site(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Site]:
    with Site(request.param, tmp_path) as site:
        yield site


def write(writer: SwitchInterface, value: float) -> None:
    writer.value = value
    writer.write()


def test_each_write_is_published_once_in_order_with_its_stamp(site):
    writer = site.board.open_for_writing(SwitchInterface, "s")
    with forwarded(site, "SwitchInterface") as run:
        assert run.found == 1
        stamps = []
        for number in range(1, 101):
            write(writer, number)
            stamps.append(writer.timestamp_us)
        until(lambda: len(run.levels()) == 100)
    assert run.levels() == list(range(1, 101))
    writes = [event for event in run.published if isinstance(event, InterfaceWrite)]
    assert [event.time_us for event in writes] == stamps
    blocks = [event for event in run.published if isinstance(event, BlockWrite)]
    assert [event.uid for event in blocks] == ["SwitchInterface::s"] * 100
    assert blocks[-1].block == writer.to_bytes()
    assert run.forwarder.write_counts == {"SwitchInterface::s": 100}


def test_earlier_data_are_not_published(site):
    write(site.board.open_for_writing(SwitchInterface, "s"), 1)
    with forwarded(site, "SwitchInterface") as run:
        pass
    assert run.levels() == []


def test_write_during_registration_is_published_once(tmp_path, monkeypatch):
    with Site("local", tmp_path) as site:
        writer, register = site.board.open_for_writing(SwitchInterface, "s"), site.board.register_listener

        def write_and_register(*arguments: Any) -> None:
            write(writer, 1)
            register(*arguments)

        monkeypatch.setattr(site.board, "reports_writes", False, raising=False)
        monkeypatch.setattr(site.board, "register_listener", write_and_register)
        with forwarded(site, "SwitchInterface") as run:
            (followed,) = run.forwarder._followed.values()
            run.forwarder.data_refreshed(followed.instance)  # the event of the first write is late
            write(writer, 2)
    assert run.levels() == [1, 2]


def test_only_matching_interfaces_are_published(site):
    writers = [site.board.open_for_writing(SwitchInterface, name) for name in ("ab", "ac", "b")]
    with forwarded(site, "SwitchInterface::a[!b]", "SwitchInterface::b") as run:
        for writer in writers:
            write(writer, 1)
        until(lambda: run.levels("SwitchInterface::ac") and run.levels("SwitchInterface::b"))
    assert sorted(run.forwarder.write_counts) == ["SwitchInterface::ac", "SwitchInterface::b"]


def test_later_interface_is_published_with_its_data(site):
    with forwarded(site, "SwitchInterface") as run:
        writer = site.board.open_for_writing(SwitchInterface, "s")
        write(writer, 1)
        until(lambda: run.follows("SwitchInterface::s"))
        write(writer, 2)
        until(lambda: run.levels()[-1:] == [2])
    assert run.levels() == [1, 2]


def test_interface_ends_with_last_writer_and_may_return(site):
    with forwarded(site, "SwitchInterface") as run:
        for number in (1, 2):
            with site.board.open_for_writing(SwitchInterface, "s") as writer:
                until(lambda: run.lines().count("Recording SwitchInterface::s") == number)  # noqa: B023
                write(writer, number)
                until(lambda: run.levels()[-1:] == [number])  # noqa: B023
            until(lambda: not site.board.list("SwitchInterface"))
    assert run.levels() == [1, 2]


@pytest.mark.parametrize("transport", ["ipc", "tcp"])
def test_writes_before_end_are_published(transport, tmp_path):
    with Site(transport, tmp_path) as site:
        writer = site.board.open_for_writing(SwitchInterface, "s")
        with forwarded(site, "SwitchInterface") as run:
            waiting = run.board._dispatcher._queue.qsize  # type: ignore[attr-defined]
            with run.forwarder._lock:  # the listener has to wait
                for number in range(1, 51):
                    write(writer, number)
                until(lambda: waiting() == 49)
        assert run.levels() == list(range(1, 51))


def test_invalid_stamp_is_replaced_by_time_of_arrival(site):
    writer = site.board.open_for_writing(SwitchInterface, "s")
    with forwarded(site, "SwitchInterface") as run:
        writer.auto_timestamping = False
        writer.set_timestamp(1 << 60)
        write(writer, 1)
        until(run.levels)
    (write_event,) = [event for event in run.published if isinstance(event, InterfaceWrite)]
    (block_event,) = [event for event in run.published if isinstance(event, BlockWrite)]
    assert write_event.time_us == block_event.time_us < 1 << 53


def test_disabled_forwarder_publishes_nothing(site):
    writer = site.board.open_for_writing(SwitchInterface, "s")
    with forwarded(site, "SwitchInterface") as run:
        reader = run.board.open_for_reading(SwitchInterface, "s")
        for number, enabled in enumerate((True, False, True), 1):
            run.forwarder.is_enabled = enabled
            write(writer, number)
            until(lambda: reader.read() and reader.value == number)  # noqa: B023
            run.board.flush()
    assert run.levels() == [1, 3]
    assert run.forwarder.write_counts == {"SwitchInterface::s": 2}


@pytest.mark.parametrize("transport", REMOTE)
def test_forwarder_follows_restarted_server_with_one_gap(transport, tmp_path):
    with Site(transport, tmp_path) as site, forwarded(site, "SwitchInterface") as run:
        writer = site.board.open_for_writing(SwitchInterface, "s")
        until(lambda: run.follows("SwitchInterface::s"))
        write(writer, 1)
        until(lambda: run.levels() == [1])
        site.down()
        until(lambda: not run.board.connected)
        site.up()
        until(lambda: run.forwarder.gaps)
        write(site.board.open_for_writing(SwitchInterface, "s"), 2)
        write(site.board.open_for_writing(SwitchInterface, "new"), 3)
        until(lambda: run.levels() == [1, 2] and run.levels("SwitchInterface::new") == [3])
    assert len(run.forwarder.gaps) == 1
    assert run.forwarder.gaps[0].seconds > 0
    assert sum("A gap" in line for line in run.lines()) == 1
    assert not any("disappeared before" in line for line in run.lines())


@pytest.mark.parametrize("transport", REMOTE)
def test_lost_server_is_gap(transport, tmp_path):
    with Site(transport, tmp_path) as site:
        with forwarded(site, "SwitchInterface") as run:
            site.down()
            until(lambda: not run.board.connected)
            until(lambda: run.forwarder._lost_since)
        site.up()
    assert len(run.forwarder.gaps) == 1


def test_unknown_type_is_logged_once_and_other_types_published(tmp_path):
    (tmp_path / "OtherInterface.xml").write_text(
        '<interface name="OtherInterface" author="x" year="1"><data><comment>c</comment>'
        '<field name="a" type="int32">a</field></data></interface>'
    )
    with Site("ipc", tmp_path, tmp_path) as site:
        site.board.open_for_writing("OtherInterface", "o")
        writer = site.board.open_for_writing(SwitchInterface, "s")
        with forwarded(site, "*") as run:
            with site.board.open_for_reading("OtherInterface", "o"):
                pass
            write(writer, 1)
            until(run.levels)
        assert len([line for line in run.lines() if "cannot be recorded" in line]) == 1
