"""The command `cxbridge trace report`."""

from __future__ import annotations

from cxbridge.cli.main import invoke
from cxbridge.trace.formats.mcap.writer import McapWriter
from tests.trace.runs import family
from web_tests.test_report import embedded_settings


def write_recording(tmp_path):
    path = tmp_path / "run.mcap"
    with McapWriter(path) as writer:
        for event in family():
            writer.write(event)
    return path


def test_report_writes_page_with_title(tmp_path, capsys):
    page = tmp_path / "run.html"
    assert (
        invoke(["trace", "report", str(write_recording(tmp_path)), "-o", str(page), "--title", "A & B"]) == 0
    )
    assert "<title>A &amp; B</title>" in page.read_text()
    assert "run.html" in capsys.readouterr().out


def test_report_does_not_replace_recording(tmp_path, capsys):
    path = write_recording(tmp_path)
    before = path.read_bytes()
    assert invoke(["trace", "report", str(path), "-o", str(path)]) == 2
    assert path.read_bytes() == before
    assert "replace" in capsys.readouterr().err


def test_report_notes_cut_off_recording(tmp_path, capsys):
    path = write_recording(tmp_path)
    path.write_bytes(path.read_bytes()[:-40])
    page = tmp_path / "run.html"
    assert invoke(["trace", "report", str(path), "-o", str(page)]) == 0
    assert "cut off" in capsys.readouterr().err
    assert "cut off" in embedded_settings(page.read_text())["notes"][0]
