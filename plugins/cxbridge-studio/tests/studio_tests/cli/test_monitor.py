"""The command ``cxbridge monitor`` reports mistakes before the screen opens."""

from __future__ import annotations

import sys

import pytest

from cxbridge.cli.main import invoke


def test_missing_textual_is_an_error_with_package(monkeypatch, capsys):
    monkeypatch.delitem(sys.modules, "cxbridge_studio.monitor.screen", raising=False)
    monkeypatch.setitem(sys.modules, "textual", None)
    assert invoke(["monitor"]) == 2
    assert "cxbridge-studio" in capsys.readouterr().err


def test_invalid_recording_is_an_error(tmp_path, capsys):
    pytest.importorskip("textual")
    path = tmp_path / "a.txt"
    path.write_text("hello\n")
    assert invoke(["monitor", str(path)]) == 2
    assert f"{path}: not a recorded run" in capsys.readouterr().err
    assert invoke(["monitor", str(tmp_path / "none")]) == 2
    assert "cannot be read" in capsys.readouterr().err
