"""The command `cxbridge keys`."""

from __future__ import annotations

from cxbridge.cli.main import invoke


def test_keys(tmp_path, capsys):
    assert invoke(["keys", "robot", "-o", str(tmp_path / "keys")]) == 0
    files = [str(tmp_path / "keys" / name) for name in ("robot.key", "robot.key_secret")]
    assert capsys.readouterr().out.splitlines() == files


def test_existing_keys_are_an_error(tmp_path, capsys):
    assert invoke(["keys", "robot", "-o", str(tmp_path)]) == 0
    assert invoke(["keys", "robot", "-o", str(tmp_path)]) == 2
    assert "the key file exists already" in capsys.readouterr().err


def test_impossible_folder_is_an_error(tmp_path, capsys):
    (tmp_path / "file").touch()
    assert invoke(["keys", "robot", "-o", str(tmp_path / "file" / "keys")]) == 2
    assert "cxbridge: error:" in capsys.readouterr().err
