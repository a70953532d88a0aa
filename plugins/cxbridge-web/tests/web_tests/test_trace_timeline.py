"""``cxbridge trace timeline``."""

from __future__ import annotations

from cxbridge.cli.main import invoke
from web_tests.test_trace_report import recorded
from web_tests.timeline.checker import counts, load


def test_a_timeline_is_written(tmp_path, capsys):
    out = tmp_path / "run.json"
    assert invoke(["trace", "timeline", str(recorded(tmp_path)), "-o", str(out)]) == 0
    assert counts(load(out))["B goal"] == 3
    assert "trace events" in capsys.readouterr().out


def test_the_recording_is_not_replaced(tmp_path, capsys):
    path = recorded(tmp_path)
    before = path.read_bytes()
    assert invoke(["trace", "timeline", str(path), "-o", str(path)]) == 2
    assert path.read_bytes() == before
    assert "replace" in capsys.readouterr().err
