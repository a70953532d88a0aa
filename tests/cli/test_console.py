"""The console: equal lines of the log are counted, and progress is one line."""

from __future__ import annotations

import sys

import pytest

from cxbridge.cli.console import ConsoleLog, progress_line
from cxbridge.events import Level, LogLine
from tests.cli.test_story import Stream

LOOP_US = 33_333


def lines(*texts: str, time_us: int = 0) -> list[LogLine]:
    return [LogLine(time_us, Level.WARN, "Rules", text) for text in texts]


def print_lines(capsys: pytest.CaptureFixture[str], events: list[LogLine]) -> list[str]:
    log = ConsoleLog()
    for event in events:
        log(event)
    log.finish()
    return [line.removeprefix("W Rules: ") for line in capsys.readouterr().err.splitlines()]


def test_alternating_lines_are_counted_separately(capsys: pytest.CaptureFixture[str]) -> None:
    found = print_lines(capsys, [*lines("ping", "pong") * 62_502, *lines("end")])
    assert found == [
        *["ping", "pong"] * 3,
        "end",
        "ping ... repeated 62,499 times",
        "pong ... repeated 62,499 times",
    ]


def test_count_precedes_line_of_next_loop(capsys: pytest.CaptureFixture[str]) -> None:
    found = print_lines(capsys, [*lines("ping") * 5, *lines("ping", "end", time_us=LOOP_US)])
    assert found == ["ping", "ping", "ping", "ping ... repeated 2 times", "ping", "end"]


def test_line_of_each_loop_is_printed_each_time(capsys: pytest.CaptureFixture[str]) -> None:
    found = print_lines(
        capsys, [line for loop in range(20) for line in lines("slow", time_us=loop * LOOP_US)]
    )
    assert found == ["slow"] * 20


def test_different_lines_are_all_printed(capsys: pytest.CaptureFixture[str]) -> None:
    texts = [f"item {number}" for number in range(1_000)] + [chr(0x4E00 + number) for number in range(5_000)]
    assert print_lines(capsys, lines(*texts)) == texts


def test_progress_is_a_temporary_line_of_terminals(monkeypatch):
    for stream, hidden, shown in (
        (Stream(True), False, True),
        (Stream(True), True, False),
        (Stream(False), False, False),
    ):
        monkeypatch.setattr(sys, "stderr", stream)
        with progress_line(hidden=hidden) as show:
            show("3 s\n12 writes")
        text = stream.getvalue()
        assert ("12 writes" in text) is shown
        assert "\n" not in text
        assert text.endswith("\r\x1b[K\r" if shown else "")
