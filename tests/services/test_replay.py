"""``trace replay``: whole recordings over every transport, and each way in which it ends."""

from __future__ import annotations

import json
import signal
import threading
from contextlib import contextmanager, nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from cxbridge.cli.main import invoke
from cxbridge.daemon.services.options import ReplayOptions
from cxbridge.daemon.services.replay import DONE, INTERRUPTED, LOST, ReplayReport, _ReplaySession, replay
from cxbridge.errors import BlackBoardError, CxbridgeError, TraceError
from cxbridge.events import BlockWrite
from cxbridge.interfaces import InterfaceRegistry, SwitchInterface
from cxbridge.trace.formats.base import Attachment
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge.trace.replay.block_maker import BlockMaker
from tests.programs import Started
from tests.support import SHARED, needs_plugin, needs_shared
from tests.trace.boards import REMOTE, WAIT_S, Site, until
from tests.trace.replay.samples import BEGIN_US, UID, WriteListener, begin, record, write

RECORDING = SHARED / "traces" / "test-scenario" / "skiller-1" / "bblogger"


@pytest.mark.parametrize("connected", [True, False])
def test_an_error_without_a_connection_is_the_loss_of_the_connection(connected, tmp_path):
    class Refusing:
        write_counts = {}  # noqa: RUF012 - never changed

        def play(self, *_arguments):
            raise BlackBoardError("no")

    board: Any = SimpleNamespace(connected=connected, add_connection_callback=lambda _callback: None)
    player: Any = Refusing()
    report = ReplayReport("run", "url")
    session = _ReplaySession(ReplayOptions(run=tmp_path), board, player, report, threading.Event(), print)
    with pytest.raises(BlackBoardError) if connected else nullcontext():
        session.run(list)
    assert report.end == ("" if connected else LOST)


class Running:
    """A replay in a thread."""

    def __init__(self, options):
        self.report = None
        self.reported_ends = []
        self._options = options
        self._ready = threading.Event()
        self._stop = lambda: None
        self._thread = threading.Thread(target=self._run)
        self._thread.start()
        assert self._ready.wait(WAIT_S)

    def _run(self):
        def on_ready(stop):
            self._stop = stop
            self._ready.set()

        try:
            self.report = replay(
                self._options,
                on_ready=on_ready,
                on_progress=lambda report: self.reported_ends.append(report.end),
            )
        finally:
            self._ready.set()

    def stop(self):
        self._stop()
        return self.join()

    def join(self):
        self._thread.join(WAIT_S)
        assert not self._thread.is_alive()
        return self.report


@contextmanager
def site_with_ear(transport, folder):
    with Site(transport, folder) as site:
        yield site, WriteListener(site.board)


def bblogger_folder(folder):
    """A recording of two writes as bblogger writes it."""
    from cxbridge_fawkes.bblogger.writer import BBLoggerWriter

    path = folder / "logs"
    schema = InterfaceRegistry().schema("SwitchInterface")
    with BBLoggerWriter(path, "test", start_us=BEGIN_US) as writer:
        for value in (1, 2):
            event = write(value, value)
            block = BlockMaker(SwitchInterface).make_block(event.values, event.time_us, UID)
            writer.write(BlockWrite(event.time_us, UID, schema.hash, block))
    return path


@pytest.mark.parametrize("transport", REMOTE)
@pytest.mark.parametrize("kind", ["mcap", pytest.param("bblogger", marks=needs_plugin("fawkes"))])
def test_a_recording_comes_to_its_end(transport, kind, tmp_path):
    run = (
        record(tmp_path / "r.mcap", write(1, 1), write(2, 2)) if kind == "mcap" else bblogger_folder(tmp_path)
    )
    with site_with_ear(transport, tmp_path) as (site, ear):
        report = replay(ReplayOptions(run=run, url=site.url))
        until(lambda: len(ear.writes) == 2)
    assert (report.end, report.write_counts, report.round_count) == (DONE, {UID: 2}, 1)
    assert ear.writes == [(1, BEGIN_US + 1000), (2, BEGIN_US + 2000)]


@needs_shared
@needs_plugin("fawkes")
@pytest.mark.parametrize("transport", ["ipc", "fawkes"])
def test_a_folder_that_fawkes_wrote_is_played(transport: str, tmp_path: Path) -> None:
    told: list[Any] = []
    with Site(transport, tmp_path) as site:
        assert site.board.bus is not None
        site.board.bus.subscribe(told.append, BlockWrite)
        report = replay(ReplayOptions(run=RECORDING, url=site.url, speed=1000))
        assert sum(report.write_counts.values()) == 28
        until(lambda: len(told) == 29)  # a Skiller that leaves ends the control that the recording ends with
    *mine, _last = [event.block for event in told if event.uid == "SkillerInterface::Skiller"]
    file = next(RECORDING.glob("*SkillerInterface*"))
    data, size = file.read_bytes()[196:], 8 + len(mine[0])
    assert mine == [data[at + 8 : at + size] for at in range(0, len(data), size)]


@pytest.mark.parametrize("transport", REMOTE)
def test_a_lost_connection_is_the_end(transport, tmp_path):
    run = record(tmp_path / "r.mcap", write(0, 1), write(3_600_000, 2))
    site = Site(transport, tmp_path)
    ear = WriteListener(site.board)
    try:
        running = Running(ReplayOptions(run=run, url=site.url))
        until(lambda: ear.values == [1])
    finally:
        site.down()
    assert running.join().end == LOST


def test_a_loop_goes_on_until_it_is_stopped(tmp_path):
    run = record(tmp_path / "r.mcap", write(0, 1), write(1, 2))
    with site_with_ear("ipc", tmp_path) as (site, ear):
        running = Running(ReplayOptions(run=run, url=site.url, loop=True))
        until(lambda: len(ear.writes) >= 5)
        report = running.stop()
    assert (report.round_count >= 3, running.reported_ends[-1]) == (True, INTERRUPTED)
    assert ear.values[:5] == [1, 2, 1, 2, 1]


def test_a_type_that_only_the_recording_knows_comes_from_its_attachment(tmp_path):
    xml = (
        b'<!DOCTYPE interface SYSTEM "interface.dtd"><interface name="OddInterface">'
        b'<data><comment>c</comment><field type="int32" name="number">c</field></data></interface>'
    )
    event = write(0, 1, "OddInterface::o")
    event = type(event)(event.time_us, event.uid, {"number": 7})
    with McapWriter(tmp_path / "r.mcap") as writer:
        writer.attach(Attachment("interfaces/OddInterface.xml", "text/xml", xml))
        writer.write(begin())
        writer.write(event)
    known = tmp_path / "known"
    known.mkdir()
    (known / "OddInterface.xml").write_bytes(xml)
    with Site("ipc", tmp_path, known) as site:
        reader = site.board.open_for_reading("OddInterface", "o")
        assert replay(ReplayOptions(run=tmp_path / "r.mcap", url=site.url)).end == DONE
        until(reader.read)
        assert reader.as_dict() == {"number": 7}


def test_an_unknown_type_is_one_error(tmp_path):
    run = record(tmp_path / "r.mcap", write(0, 1, "OddInterface::o"))
    with Site("ipc", tmp_path) as site, pytest.raises(CxbridgeError, match="OddInterface"):
        replay(ReplayOptions(run=run, url=site.url))


def test_a_recording_without_interface_writes_is_one_error(tmp_path):
    run = record(tmp_path / "r.mcap")
    with pytest.raises(TraceError, match="holds no interface writes"):
        replay(ReplayOptions(run=run, url="tcp://127.0.0.1:1"))


def test_a_pattern_that_selects_nothing_is_one_error(tmp_path):
    run = record(tmp_path / "r.mcap", write(0, 1))
    with pytest.raises(TraceError, match="is selected"):
        replay(ReplayOptions(run=run, url="tcp://127.0.0.1:1", patterns=("SkillerInterface",)))


def test_the_command_prints_a_summary(tmp_path, capsys):
    run = record(tmp_path / "r.mcap", write(0, 1), write(1, 2))
    with Site("ipc", tmp_path) as site:
        assert invoke(["trace", "replay", str(run), "--connect", site.url, "--json"]) == 0
        summary = json.loads(capsys.readouterr().out)
        assert (summary["end"], summary["interfaces"]) == ("done", {UID: 2})
        assert invoke(["trace", "replay", str(run), "--connect", site.url, "--from", "2", "--to", "1"]) == 2
        site.board.open_for_writing(SwitchInterface, "s", owner="robot")
        assert invoke(["trace", "replay", str(run), "--connect", site.url]) == 2
        assert "it has a writer already" in capsys.readouterr().err


@pytest.mark.parametrize(("options", "status"), [((), 130), (("--loop",), 0)])
def test_ctrl_c_ends_it_cleanly(options, status, tmp_path):
    run = record(tmp_path / "r.mcap", write(0, 1), write(3_600_000, 2))
    with site_with_ear("ipc", tmp_path) as (site, ear):
        with Started("trace", "replay", run, "--connect", site.url, *options) as process:
            until(lambda: ear.values)
            process.send_signal(signal.SIGINT)
            out, _ = process.communicate(timeout=WAIT_S)
        assert process.returncode == status
        assert out.startswith("interrupted: 1 write of 1 interface in ")
        until(lambda: not ear.reader.has_writer)
