"""``cxbridge monitor``: mistakes are reported before there is a screen."""

from __future__ import annotations

import sys

import pytest

from cxbridge.cli.main import invoke


def test_without_textual_it_is_said(monkeypatch, capsys):
    monkeypatch.delitem(sys.modules, "cxbridge_studio.monitor.screen", raising=False)
    monkeypatch.setitem(sys.modules, "textual", None)
    assert invoke(["monitor"]) == 2
    assert "cxbridge-studio" in capsys.readouterr().err


def test_what_is_no_recording_is_one_error(tmp_path, capsys):
    pytest.importorskip("textual")
    path = tmp_path / "a.txt"
    path.write_text("hello\n")
    assert invoke(["monitor", str(path)]) == 2
    assert f"{path}: not a recorded run" in capsys.readouterr().err
    assert invoke(["monitor", str(tmp_path / "none")]) == 2
    assert "cannot be read" in capsys.readouterr().err
