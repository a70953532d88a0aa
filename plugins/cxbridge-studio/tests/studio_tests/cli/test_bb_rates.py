"""The command `cxbridge bb hz`."""

from __future__ import annotations

import json
import re
import threading
from contextlib import ExitStack

import pytest

from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
from cxbridge.cli.main import invoke
from cxbridge.interfaces import SwitchInterface
from cxbridge_studio.cli import bb_rates as rates
from cxbridge_studio.write_rates import RateMeter
from tests.cli.boards import SharedBoard
from tests.fawkes import TRANSPORT, fawkes_server


class WriterThread:
    """A thread that writes an interface with a new value each time."""

    def __init__(self, board):
        self._writer = board.open_for_writing(SwitchInterface, "S", owner="writer")
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def _run(self):
        while not self._stop.wait(0.005):
            self._writer.value += 1.0
            self._writer.write()

    def __enter__(self):
        self._thread.start()

    def __exit__(self, *_error):
        self._stop.set()
        self._thread.join()


@pytest.fixture
def board(monkeypatch):
    board = SharedBoard()
    monkeypatch.setattr(rates, "connect", lambda _url, _dirs: board)
    yield board
    assert board.left_open() == []
    board.shutdown()


@pytest.mark.parametrize(
    ("times_s", "expected"),
    [
        ((), None),
        ((1.0,), None),
        ((1.0, 1.0), (float("inf"), 0.0, 0.0, 0.0, 2)),
        ((0.0, 0.1, 0.4), (5.0, 0.1, 0.3, 0.1, 3)),
        ((0.0, 10.0, 10.5, 11.0), (2.0, 0.5, 0.5, 0.0, 3)),  # the window slides
    ],
)
def test_rate_of_writes(times_s, expected):
    meter = RateMeter(window=3)
    for time_s in times_s:
        meter.add(time_s)
    rate = meter.rate()
    numbers = rate and (rate.hz, rate.shortest_s, rate.longest_s, rate.deviation_s, rate.window)
    assert numbers == (expected and pytest.approx(expected))
    assert (meter.count_new_writes(), meter.count_new_writes()) == (len(times_s), 0)


@pytest.mark.parametrize("transport", ["zmq", *TRANSPORT])
def test_rates_on_each_transport(transport, tmp_path, capsys):
    board = SharedBoard()
    with ExitStack() as stack:
        stack.callback(board.shutdown)
        if transport == "zmq":
            url = f"ipc://{tmp_path}/b"
            server = ZmqBlackBoardServer(board, [url])
        else:
            server = fawkes_server(board)
            url = f"fawkes://127.0.0.1:{server.port}"
        server.start()
        stack.callback(server.stop)
        stack.enter_context(WriterThread(board))
        options = ("--every", "0.3", "--count", "3", "--json", "--connect", url)
        assert invoke(["bb", "hz", "SwitchInterface::*", *options]) == 0
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [row["uid"] for row in rows] == ["SwitchInterface::S"] * 3
    assert rows[-1]["new_writes"] > 0
    assert 0 < rows[-1]["hz"] < 500
    assert rows[-1]["bytes_per_s"] == pytest.approx(rows[-1]["hz"] * SwitchInterface.SCHEMA.datasize)


def test_output_has_line_for_each_interface(board, capsys):
    with WriterThread(board):
        assert invoke(["bb", "hz", "SwitchInterface", "--every", "0.3", "--count", "2"]) == 0
    number = r"\d+\.\d+"
    gaps = rf"min {number} s  max {number} s  std dev {number} s"
    pattern = rf"SwitchInterface::S  +{number} Hz  {gaps}  window \d+"
    assert re.fullmatch(pattern, capsys.readouterr().out.splitlines()[-1])


def test_interface_without_writes_has_no_rate(board, capsys):
    board.open_for_writing(SwitchInterface, "S", owner="writer")
    assert invoke(["bb", "hz", "SwitchInterface", "--every", "0.05", "--count", "1"]) == 0
    assert capsys.readouterr().out == "SwitchInterface::S  fewer than two writes yet\n"
    assert invoke(["bb", "hz", "SwitchInterface", "--every", "9", "--count", "5", "--timeout", "0.1"]) == 3
