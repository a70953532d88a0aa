"""The commands `cxbridge bb hz`, `bb bw` and `bb plot`."""

from __future__ import annotations

import json
import re
import threading
from typing import Any

import pytest

from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
from cxbridge.cli.main import invoke
from cxbridge.interfaces import SkillerInterface, SwitchInterface
from cxbridge_studio.cli import bb_plot as plotting
from cxbridge_studio.cli import bb_rates as rates
from cxbridge_studio.terminal.metering import RateMeter, draw_plot, format_bytes
from tests.cli.boards import SharedBoard
from tests.fawkes import TRANSPORT, fawkes_server


class Writing:
    """A thread that writes an interface, another value each time."""

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
    made = SharedBoard()
    for module in (rates, plotting):
        monkeypatch.setattr(module, "connect", lambda _url, _dirs: made)
    yield made
    assert made.left_open() == []
    made.shutdown()


class TestMeters:
    def test_a_rate_needs_two_times(self):
        meter = RateMeter()
        assert meter.rate() is None
        meter.add(1.0)
        assert meter.rate() is None

    def test_rate_gaps_and_deviation(self):
        meter = RateMeter()
        for time_s in (0.0, 0.1, 0.4):
            meter.add(time_s)
        rate = meter.rate()
        assert rate is not None
        assert rate.hz == pytest.approx(5.0)
        assert rate.shortest_s == pytest.approx(0.1)
        assert rate.longest_s == pytest.approx(0.3)
        assert rate.deviation_s == pytest.approx(0.1)
        assert (meter.new_writes(), meter.new_writes()) == (3, 0)

    def test_the_window_slides(self):
        meter = RateMeter(window=3)
        for time_s in (0.0, 10.0, 10.5, 11.0):
            meter.add(time_s)
        rate = meter.rate()
        assert rate is not None
        assert rate.hz == pytest.approx(2.0)
        assert rate.window == 3

    def test_two_writes_at_one_time_are_no_division_by_zero(self):
        meter = RateMeter()
        meter.add(1.0)
        meter.add(1.0)
        rate = meter.rate()
        assert rate is not None
        assert rate.hz == float("inf")

    @pytest.mark.parametrize(
        ("size", "text"),
        [(0, "0 B"), (999, "999 B"), (1000, "1.00 kB"), (2.5e6, "2.50 MB"), (3e12, "3000.00 GB")],
    )
    def test_amounts(self, size, text):
        assert format_bytes(size) == text


class TestDrawing:
    def test_a_step_goes_along_and_then_up(self):
        lines = list(draw_plot([(0.0, 0.0), (10.0, 0.0), (10.0, 1.0)], 20, 3, 10.0))
        assert [line.split("┤")[0].strip() for line in lines[:3]] == ["1.00", "0.50", "0.00"]
        assert set(lines[2].split("┤")[1]) <= set("⣀⡀⢀⣸⢸")
        assert lines[3].strip().startswith("└")
        assert lines[4].split() == ["-10", "s", "now"]

    @pytest.mark.parametrize(
        "points",
        [[], [(0.0, 5.0)], [(0.0, float("nan")), (1.0, 1.0)], [(0.0, 1e12), (1.0, -1e12)], [(0.0, 0.0)] * 3],
    )
    @pytest.mark.parametrize("size", [(80, 20), (10, 1), (3, 2)])
    def test_it_fits_whatever_the_values_are(self, points, size):
        lines = list(draw_plot(points, size[0], size[1], 30.0))
        assert len(lines) == size[1] + 2
        if size[0] > 20:
            assert max(map(len, lines)) <= size[0]

    def test_a_screen_is_full_and_no_more(self):
        points = {"a": [(0.0, 1.0)], "b": [(1.0, 2.0), (2.0, 3.0)]}
        for rows in (10, 24, 60):
            lines = plotting.make_screen_lines("T::I", points, 3.0, 30.0, (80, rows))
            assert len(lines) <= rows
            assert lines[0] == "T::I a = 1"
            assert lines[-1] == "Ctrl-C ends"


@pytest.mark.parametrize("transport", ["local", "zmq", *TRANSPORT])
def test_rates_on_every_transport(transport, monkeypatch, tmp_path, capsys):
    if transport == "local":
        board, url = SharedBoard(), "tcp://unused"
        monkeypatch.setattr(rates, "connect", lambda _url, _dirs: board)
        server: Any = None
    else:
        board = SharedBoard()
        if transport == "zmq":
            url = f"ipc://{tmp_path}/b"
            server = ZmqBlackBoardServer(board, [url])
        else:
            server = fawkes_server(board)
            url = f"fawkes://127.0.0.1:{server.port}"
        server.start()
    try:
        with Writing(board):
            for command in ("hz", "bw"):
                more = ("--every", "0.3", "--count", "3", "--json", "--connect", url)
                assert invoke(["bb", command, "SwitchInterface::*", *more]) == 0
                rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
                assert [row["uid"] for row in rows] == ["SwitchInterface::S"] * 3
                assert rows[-1]["new_writes"] > 0
                assert 0 < rows[-1]["hz"] < 500
                assert rows[-1]["bytes_per_s"] == pytest.approx(
                    rows[-1]["hz"] * SwitchInterface.SCHEMA.datasize
                )
    finally:
        if server is not None:
            server.stop()
        board.shutdown()


def test_lines_for_people(board, capsys):
    with Writing(board):
        assert invoke(["bb", "hz", "SwitchInterface", "--every", "0.3", "--count", "2"]) == 0
        last = capsys.readouterr().out.splitlines()[-1]
        number = r"\d+\.\d+"
        gaps = rf"min {number} s  max {number} s  std dev {number} s"
        pattern = rf"SwitchInterface::S  +{number} Hz  {gaps}  window \d+"
        assert re.fullmatch(pattern, last)
        assert invoke(["bb", "bw", "SwitchInterface", "--every", "0.3", "--count", "2"]) == 0
        assert re.search(
            r"B/s  +\d+\.\d+ Hz  block \d+ B  window \d+$", capsys.readouterr().out.splitlines()[-1]
        )


def test_nobody_writes(board, capsys):
    board.open_for_writing(SwitchInterface, "S", owner="writer")
    assert invoke(["bb", "hz", "SwitchInterface", "--every", "0.05", "--count", "1"]) == 0
    assert capsys.readouterr().out == "SwitchInterface::S  fewer than two writes yet\n"
    assert invoke(["bb", "hz", "SwitchInterface", "--every", "9", "--count", "5", "--timeout", "0.1"]) == 3


def test_plot_off_a_terminal_is_a_line_a_write(board, capsys):
    with Writing(board):
        assert invoke(["bb", "plot", "SwitchInterface::S", "value", "enabled", "--count", "3"]) == 0
    rows = [line.split("\t") for line in capsys.readouterr().out.splitlines()]
    assert len(rows) == 3
    assert [row[2] for row in rows] == ["0", "0", "0"]
    values = [float(row[1]) for row in rows]
    assert values == sorted(values)


@pytest.mark.parametrize(
    ("uid", "field", "said"),
    [
        ("SwitchInterface::S", "valu", "value"),
        ("SwitchInterface::S", "value[0]", "'value' is not an array"),
        ("SkillerInterface::Skiller", "skill_string", "is text"),
        ("Position3DInterface::P", "translation", "translation[0] to translation[2]"),
        ("Position3DInterface::P", "translation[3]", "translation[0] to translation[2]"),
    ],
)
def test_what_cannot_be_plotted_is_told_at_once(board, uid, field, said, capsys):
    assert invoke(["bb", "plot", uid, field]) == 2
    assert said in capsys.readouterr().err


def test_enums_are_plotted_by_their_numbers():
    values = {"status": SkillerInterface.S_RUNNING, "on": True}
    assert plotting.read_number("status", values) == SkillerInterface.S_RUNNING.value
    assert plotting.read_number("on", values) == 1.0
