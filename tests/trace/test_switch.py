"""The switch of a recording: messages of Fawkes' ``ffbblog enable`` and ``disable``, on every transport."""

from __future__ import annotations

import pytest

from cxbridge.blackboard.errors import WriterActiveError
from cxbridge.clock import RealClock
from cxbridge.events import EventBus, LogLine
from cxbridge.interfaces import SwitchInterface
from cxbridge.trace.switch import RecordingSwitch
from tests.trace.boards import TRANSPORTS, Site, until

Enable, Disable, SetIt = (
    SwitchInterface.MESSAGES[f"{name}Message"] for name in ("EnableSwitch", "DisableSwitch", "Set")
)


@pytest.mark.parametrize("transport", TRANSPORTS)
def test_messages_switch_and_the_interface_shows_it(transport, tmp_path):
    with Site(transport, tmp_path) as site:
        board = site.connect()
        heard: list[bool] = []
        lines: list[LogLine] = []
        bus = EventBus(RealClock())
        bus.subscribe(lines.append, LogLine)  # type: ignore[arg-type]
        switch = RecordingSwitch(board, heard.append, bus.logger("test"))
        reader = site.board.open_for_reading(SwitchInterface, "BBLogger")
        until(lambda: reader.read() and reader.enabled)
        for number, (message, enabled) in enumerate(
            ((Disable, False), (Disable, False), (Enable, True), (Disable, False)), 1
        ):
            before = reader.timestamp_us
            reader.msgq_enqueue(message())
            until(lambda: reader.read() and reader.timestamp_us > before)  # noqa: B023
            assert reader.enabled is enabled
            assert len(heard) == number
            assert heard[-1] is enabled
        reader.msgq_enqueue(SetIt())
        until(lambda: any("does not support SetMessage" in line.text for line in lines))
        assert len(heard) == 4
        switch.close()
        until(lambda: not reader.has_writer)
        if board is not site.board:
            board.shutdown()


def test_there_is_one_switch(tmp_path):
    with Site("local", tmp_path) as site:
        log = EventBus(RealClock()).logger("test")
        RecordingSwitch(site.board, print, log)
        with pytest.raises(WriterActiveError):
            RecordingSwitch(site.board, print, log)
