"""``cxbridge trace report``."""

from __future__ import annotations

from cxbridge.cli.main import invoke
from cxbridge.trace.formats.mcap.writer import McapWriter
from tests.trace.runs import family
from web_tests.test_report import inside_of


def recorded(tmp_path):
    path = tmp_path / "run.mcap"
    with McapWriter(path) as writer:
        for event in family():
            writer.write(event)
    return path


def test_a_page_is_written(tmp_path, capsys):
    page = tmp_path / "run.html"
    assert invoke(["trace", "report", str(recorded(tmp_path)), "-o", str(page), "--title", "A & B"]) == 0
    assert "<title>A &amp; B</title>" in page.read_text()
    assert "run.html" in capsys.readouterr().out


def test_the_recording_is_not_replaced(tmp_path, capsys):
    path = recorded(tmp_path)
    before = path.read_bytes()
    assert invoke(["trace", "report", str(path), "-o", str(path)]) == 2
    assert path.read_bytes() == before
    assert "replace" in capsys.readouterr().err


def test_what_is_lost_of_a_file_that_was_cut_off_is_told(tmp_path, capsys):
    path = recorded(tmp_path)
    path.write_bytes(path.read_bytes()[:-40])
    page = tmp_path / "run.html"
    assert invoke(["trace", "report", str(path), "-o", str(page)]) == 0
    assert "cut off" in capsys.readouterr().err
    assert "cut off" in inside_of(page.read_text())["notes"][0]
