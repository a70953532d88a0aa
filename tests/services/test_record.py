"""``trace record``: what is in its files, and how it ends."""

from __future__ import annotations

import json
import signal
import threading
from contextlib import contextmanager
from pathlib import Path

import pytest

from cxbridge.cli.main import invoke
from cxbridge.daemon.services.options import RecordOptions
from cxbridge.daemon.services.record import record
from cxbridge.events import InterfaceWrite
from cxbridge.interfaces import SwitchInterface
from cxbridge.trace.formats.registry import open_run
from tests.programs import Started
from tests.support import needs_plugin
from tests.trace.boards import REMOTE, WAIT_S, Site, until


@contextmanager
def recording(site, *outputs, **more):
    """A recording in a thread; gives its report when it is over."""
    options = RecordOptions(url=site.url, patterns=("SwitchInterface::s",), outputs=outputs, **more)
    stop, ready, found = [], threading.Event(), []

    def on_ready(end):
        stop.append(end)
        ready.set()

    thread = threading.Thread(target=lambda: found.append(record(options, on_ready=on_ready)))
    thread.start()
    assert ready.wait(WAIT_S)
    try:
        yield found
    finally:
        stop[0]()
        thread.join(WAIT_S)


def values(path):
    """What was recorded so far."""
    files = [*path.iterdir()] if path.is_dir() else [path]
    if not any(file.exists() and file.stat().st_size for file in files):
        return []  # a file is there before its head is
    return [event.values["value"] for event in open_run(path) if isinstance(event, InterfaceWrite)]


def write(writer, *numbers):
    for number in numbers:
        writer.value = number
        writer.write()


@needs_plugin("fawkes")
@pytest.mark.parametrize("transport", REMOTE)
def test_files_of_both_formats_have_every_write(transport, tmp_path):
    from fawkes_tests.bblogger.test_run_bblog import check_as_fawkes_does

    outputs = (tmp_path / "logs", tmp_path / "deep" / "run.mcap")
    with Site(transport, tmp_path) as site:
        writer = site.board.open_for_writing(SwitchInterface, "s")
        with recording(site, *outputs) as found:
            write(writer, *range(1, 51))
            until(lambda: len(values(outputs[0])) == 50)
    (file,) = outputs[0].iterdir()
    assert file.name.startswith("record-SwitchInterface-s-")
    assert check_as_fawkes_does(file)[0] == 50
    assert values(outputs[0]) == values(outputs[1]) == list(range(1, 51))
    (report,) = found
    assert report.to_json()["interfaces"] == {"SwitchInterface::s": 50}
    assert (report.skipped_count, report.gaps, report.errors) == (0, [], [])


def test_it_ends_by_itself(tmp_path):
    with Site("ipc", tmp_path) as site:
        report = record(
            RecordOptions(url=site.url, patterns=("*",), outputs=(tmp_path / "a.mcap",), duration_s=0.05)
        )
    assert report.seconds >= 0.05
    assert open_run(tmp_path / "a.mcap").metadata()["skipped"] == "0"


@needs_plugin("fawkes")
def test_when_nothing_can_be_written_any_more_it_ends(tmp_path):
    with Site("ipc", tmp_path) as site:
        writer = site.board.open_for_writing(SwitchInterface, "s")
        (tmp_path / "logs").mkdir()
        with recording(site, tmp_path / "logs") as found:
            (tmp_path / "logs").rmdir()
            write(writer, 1)
            until(lambda: found)
    assert "cannot be written" in found[0].errors[0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-o", "x"], "--interface"),
        (["-i", "*"], "--output"),
        (["-i", "A:b", "-o", "x"], "'A:b' selects no interface"),
        (["-i", "*", "-o", "x", "-o", "./x"], "named twice"),
        (["-i", "*", "-o", "x", "--connect", "nonsense"], "'nonsense' is not a blackboard's URL"),
        (["-i", "*", "-o", "x", "--connect", "fawkes://127.0.0.1:1"], "127.0.0.1:1"),
    ],
)
def test_bad_input_is_one_message_and_status_2(arguments, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert invoke(["trace", "record", *arguments]) == 2
    captured = capsys.readouterr()
    assert message in captured.err
    assert "Traceback" not in captured.err
    assert list(tmp_path.iterdir()) == []


@needs_plugin("fawkes")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_it_with_whole_files(number, tmp_path):
    from fawkes_tests.bblogger.test_run_bblog import check_as_fawkes_does

    with Site("ipc", tmp_path) as site:
        writer = site.board.open_for_writing(SwitchInterface, "s")
        arguments = [
            "-i",
            "SwitchInterface::s",
            "--connect",
            site.url,
            "-o",
            str(tmp_path / "logs"),
            "--json",
        ]
        process = Started("trace", "record", *arguments)
        for line in process.stderr:
            if "Ready" in line:
                break
        write(writer, *range(1, 11))
        until(lambda: values(tmp_path / "logs")[-1:] == [10])
        process.send_signal(number)
        output, errors = process.communicate(timeout=WAIT_S)
    assert process.returncode == 0, errors
    report = json.loads(output)
    assert report["writes"] == 10
    assert report["outputs"] == [str(tmp_path / "logs")]
    (file,) = Path(tmp_path / "logs").iterdir()
    assert check_as_fawkes_does(file)[0] == 10
