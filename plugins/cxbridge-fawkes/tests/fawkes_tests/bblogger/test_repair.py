"""``trace repair`` of bblogger's files, compared with ffbblog."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.cli.main import invoke
from cxbridge.trace.formats.registry import open_run
from fawkes_tests.bblogger.bblog_files import make_file
from tests.support import needs_plugin, needs_shared
from tests.trace.runs import NAMES, RECORDINGS

needs_studio = needs_plugin("studio")


def repair(path: Path) -> tuple[bytes, list[str]]:
    repairs = open_run(path).find_repairs()
    assert repairs is not None
    actions, write = repairs
    write(path.with_name("repaired"))
    return path.with_name("repaired").read_bytes(), actions


@needs_studio
@needs_shared
@pytest.mark.parametrize("name", NAMES)
def test_recordings_are_repaired_as_by_ffbblog(name: str, tmp_path: Path) -> None:
    for path in (RECORDINGS / name / "bblogger").iterdir():
        out = tmp_path / path.name
        assert invoke(["trace", "repair", str(path), "-o", str(out)]) == 0
        assert out.read_bytes() == (RECORDINGS / name / "bblogger-repaired" / path.name).read_bytes()


def test_repair_corrects_header_and_end(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(make_file([(1, 0), (2, 0)], flag=1, count=9) + b"rest")
    data, actions = repair(path)
    assert data == make_file([(1, 0), (2, 0)], flag=0, count=2)
    assert actions == [
        "FIXING: header says big endian, but the data are little endian, setting",
        "FIXING: errorneous bytes at end of file, truncating by 4 b",
        "FIXING: header has 9 data items, but expecting 2, setting",
    ]
    path.write_bytes(data)
    assert repair(path) == (data, [])


@needs_studio
def test_repair_keeps_input_as_backup_unless_in_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.log"
    broken, repaired = make_file([(1, 0)]), make_file([(1, 0)], flag=0, count=1)
    path.write_bytes(broken)
    assert invoke(["trace", "repair", str(path), "--dry-run"]) == 0
    assert path.read_bytes() == broken
    assert capsys.readouterr().out.startswith("To be repaired, actions follow.\nFIXING: header says big")
    assert invoke(["trace", "repair", str(path), "-o", str(tmp_path / "b.log")]) == 0
    assert (path.read_bytes(), (tmp_path / "b.log").read_bytes()) == (broken, repaired)
    assert invoke(["trace", "repair", str(path), "-o", str(tmp_path / "b.log")]) == 2
    assert invoke(["trace", "repair", str(path)]) == 0
    assert (path.read_bytes(), (tmp_path / "a.log.bak").read_bytes()) == (repaired, broken)
    assert f"backup: {path}.bak\n" in capsys.readouterr().out
    assert invoke(["trace", "repair", str(path)]) == 0
    assert capsys.readouterr().out == "Nothing to repair, files are fine\n"
    path.write_bytes(broken)
    assert invoke(["trace", "repair", str(path)]) == 0
    assert (tmp_path / "a.log.bak2").read_bytes() == broken
    path.write_bytes(broken)
    assert invoke(["trace", "repair", str(path), "--in-place"]) == 0
    assert path.read_bytes() == repaired
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a.log", "a.log.bak", "a.log.bak2", "b.log"]
