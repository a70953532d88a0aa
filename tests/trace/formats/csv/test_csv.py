"""CSV as ffbblog writes it: written byte for byte, read although it quotes nothing."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cxbridge.errors import CxbridgeError, TraceError
from cxbridge.events import Event, InterfaceWrite, SkillStatus
from cxbridge.interfaces.registry import default_registry
from cxbridge.trace.convert import convert
from cxbridge.trace.formats.base import MAX_NOTES
from cxbridge.trace.formats.csv.columns import columns_of, formatter, heading
from cxbridge.trace.formats.csv.reader import CsvFile
from cxbridge.trace.formats.registry import open_run
from tests.support import many, needs_shared
from tests.trace.bblog_files import KIND, START_S, make
from tests.trace.runs import NAMES, RECORDINGS, MemoryRun

NAME = f"test-{KIND}-Flite-2014-05-13-16-53-20.csv"
HEADING = heading(columns_of(default_registry().schema(KIND)))


def writes(path: Path) -> list[InterfaceWrite]:
    return [event for event in open_run(path) if isinstance(event, InterfaceWrite)]


def read(path: Path, rows: str) -> tuple[list[Event], list[str]]:
    path.write_text(f"{HEADING}\n{rows}")
    run = open_run(path)
    assert isinstance(run, CsvFile)
    return list(run), run.notes


def recordings() -> Iterator[Path]:
    """The files as written that ffbblog could convert: not those without entries."""
    for name in NAMES:
        for path in sorted((RECORDINGS / name / "bblogger").glob("*.log")):
            if (RECORDINGS / name / "bblogger-repaired" / path.name).with_suffix(".csv").stat().st_size:
                yield path


@needs_shared
def test_recordings_become_what_ffbblog_made_of_them(tmp_path: Path) -> None:
    paths = list(recordings())
    assert len(paths) == 7
    for path in paths:
        expected = (path.parent.parent / "bblogger-repaired" / path.name).with_suffix(".csv")
        for source in (path, expected.with_suffix(".log")):
            assert convert(open_run(source), tmp_path / "out.csv", "csv") == []
            assert (tmp_path / "out.csv").read_bytes() == expected.read_bytes()


@needs_shared
def test_as_written_repaired_and_csv_agree() -> None:
    for path in recordings():
        repaired = path.parent.parent / "bblogger-repaired" / path.name
        one, other = list(open_run(path)), list(open_run(repaired))
        assert one == other
        run = open_run(repaired.with_suffix(".csv"))
        rows = list(run)
        assert not run.notes
        assert [_bare(event) for event in rows] == [_bare(event) for event in one]
        # the time of a row is when the logger wrote it, from a second on that the header tells more exactly
        for row, event in zip(rows, one, strict=True):
            assert abs(row.time_us - event.time_us) < 1_100_000


def _bare(event: Event) -> object:
    """An event without its time, and numbers as exact as in CSV."""
    if isinstance(event, SkillStatus):
        return (event.skiller, event.skill_string, event.msgid, event.status)
    assert isinstance(event, InterfaceWrite)
    values = {
        name: round(value, 6) if isinstance(value, float) else value for name, value in event.values.items()
    }
    return (event.uid, values)


@needs_shared
def test_a_folder_becomes_a_folder_and_is_read_back(tmp_path: Path) -> None:
    source = RECORDINGS / "skiller-1" / "bblogger"
    assert convert(open_run(source), tmp_path / "out", "csv") == []
    names = sorted(path.stem for path in (tmp_path / "out").iterdir())
    assert names == sorted(path.stem for path in source.iterdir())
    assert len(writes(tmp_path / "out")) == len(writes(source))


def test_any_run_becomes_csv_and_is_read_back(tmp_path: Path) -> None:
    events = [
        InterfaceWrite(
            START_S * 10**6 + step,
            f"{KIND}::a/b",
            {"text": "x;y", "msgid": step, "final": False, "duration": 0.5},
        )
        for step in range(3)
    ]
    unknown = InterfaceWrite(START_S * 10**6, "OtherInterface::x", {"a": 1})
    run = MemoryRun([*events, unknown])
    notes = convert(run, tmp_path / "out", "csv")
    assert [note.split(".")[0] for note in notes] == [
        "OtherInterface::x: left out: Interface of type 'OtherInterface' not found"
    ]
    (path,) = (tmp_path / "out").iterdir()
    assert path.name.startswith(f"run-{KIND}-a%2Fb-")
    assert list(open_run(tmp_path / "out")) == events


def test_one_file_for_several_interfaces_is_refused(tmp_path: Path) -> None:
    values = {"text": "", "msgid": 0, "final": False, "duration": 0.0}
    run = MemoryRun([InterfaceWrite(1, f"{KIND}::{each}", values) for each in "ab"])
    with pytest.raises(TraceError, match="several interfaces"):
        convert(run, tmp_path / "out.csv", "csv")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_a_full_disk_is_our_error(tmp_path: Path) -> None:
    (tmp_path / "full.csv").symlink_to("/dev/full")
    (tmp_path / "a.log").write_bytes(make("<", [(1, 0)]))
    values = {"text": "", "msgid": 0, "final": False, "duration": 0.0}
    for run in (open_run(tmp_path / "a.log"), MemoryRun([InterfaceWrite(1, f"{KIND}::a", values)])):
        with pytest.raises(TraceError, match="cannot be written"):
            convert(run, tmp_path / "full.csv", "csv")


def test_bytes_stay_as_they_are(tmp_path: Path) -> None:
    """C's way: text that is not UTF-8 as it is, an unknown item by a word, a NaN by its name."""
    (tmp_path / "a.log").write_bytes(
        make("<", [(1, 0)], fill=lambda _: {"text": b"\xff;\n", "duration": -math.nan})
    )
    convert(open_run(tmp_path / "a.log"), tmp_path / "a.csv", "csv")
    assert (tmp_path / "a.csv").read_bytes() == f"{HEADING}\n".encode() + b"1.000000;\xff;\n;0;false;-nan\n"
    assert formatter("SomeEnum")(7) == "UNKNOWN"
    assert formatter("double")(math.inf) == "inf"


def test_rows_hold_what_separates_them(tmp_path: Path) -> None:
    events, notes = read(
        tmp_path / NAME,
        "1.000000;a;b\n2.5;c;7;true;0.500000\n2.000000;;8;false;1.000000\n",
    )
    found = [event.values for event in events if isinstance(event, InterfaceWrite)]
    assert found == [
        {"text": "a;b\n2.5;c", "msgid": 7, "final": True, "duration": 0.5},
        {"text": "", "msgid": 8, "final": False, "duration": 1.0},
    ]
    assert not notes


def test_a_guess_is_told(tmp_path: Path) -> None:
    path = tmp_path / "s-AInterface-a-2014-05-13-16-53-20.csv"
    path.write_text(
        "# Time relative to beginning (in sec);one (string[8]);two (string[8])\n"
        "1.000000;a;b;c\n2.000000;a;b\n3.000000;123;45678;9\n"
    )
    run = open_run(path)
    values = [dict(event.values) for event in run if isinstance(event, InterfaceWrite)]
    assert values[0] == {"one": "a", "two": "b;c"}
    assert values[2] == {"one": "123", "two": "45678;9"}
    assert run.notes == ["line 2: a text holds ';', where it ends is a guess"]  # of line 4 one only fits


def test_what_is_wrong_in_every_row_is_not_told_for_ever(tmp_path: Path) -> None:
    _, notes = read(tmp_path / NAME, "1.000000;a;x;true;0.500000\n" * 300)
    assert len(notes) == MAX_NOTES + 1
    assert notes[-1] == "and more of this kind"


def test_damaged_rows_are_left_out(tmp_path: Path) -> None:
    events, notes = read(
        tmp_path / NAME,
        "1.000000;a;x;true;0.500000\n2.000000;b;8;false;1.000000\n3.000000;c;9;false;1.0",
    )
    assert [event.values["msgid"] for event in events if isinstance(event, InterfaceWrite)] == [8]
    assert notes == ["line 2: no row, left out", "the file ends within a row"]


def test_which_interface_it_is(tmp_path: Path) -> None:
    row = "1.000000;a;1;true;0.500000\n"
    events, _ = read(tmp_path / "any.csv", row)  # by its columns
    assert isinstance(events[0], InterfaceWrite)
    assert (events[0].uid, events[0].time_us) == (f"{KIND}::any", 1_000_000)
    events, _ = read(tmp_path / "s-%2Fx-OtherInterface-a%2Fb-2014-05-13-16-53-20.csv", row)  # by its name
    assert isinstance(events[0], InterfaceWrite)
    assert events[0].uid == "OtherInterface::a/b"
    (tmp_path / "any.info.txt").write_text(
        "Scenario:   s\nInterface:  MyInterface::b (c) (00AA)\nStart time: Tue May 13 16:53:20 2014\n"
    )
    run = open_run(tmp_path / "any.csv")
    (event,) = run
    assert isinstance(event, InterfaceWrite)
    assert event.uid == "MyInterface::b (c)"
    assert run.metadata()["scenario"] == "s"


def test_what_tells_no_interface_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "any.csv"
    path.write_text("# Time relative to beginning (in sec);a (int32[1])\n1.000000;1\n")
    with pytest.raises(TraceError, match="neither name nor columns tell"):
        list(open_run(path))


@pytest.mark.parametrize("line", ["", ";a", ";a (int32[0])", ";a (int32[1]", ";a (int32)"])
def test_a_damaged_heading_is_refused(tmp_path: Path, line: str) -> None:
    path = tmp_path / NAME
    title = "# Time relative to beginning (in sec)"
    path.write_text(f"{title}{line or ';'}\n")
    with pytest.raises(TraceError, match="names of the columns"):
        list(open_run(path))


texts = st.text(st.characters(codec="utf-8", exclude_characters="\0\\"), max_size=20)


@settings(max_examples=many(60, 25))
@given(st.lists(st.tuples(texts, st.integers(0, 9), st.booleans()), max_size=4))
def test_texts_come_back(tmp_path_factory: pytest.TempPathFactory, rows: list[tuple[str, int, bool]]) -> None:
    """With one text in a row there is nothing to guess, unless the text looks like a row itself."""
    folder = tmp_path_factory.mktemp("texts")
    fills = [{"text": text.encode(), "msgid": number, "final": flag} for text, number, flag in rows]
    (folder / "a.log").write_bytes(make("<", [(1, 0)] * len(rows), fill=fills.__getitem__))
    convert(open_run(folder / "a.log"), folder / NAME, "csv")
    found = [(event.values["text"], event.values["msgid"]) for event in writes(folder / NAME)]
    assert found == [(text, number) for text, number, _ in rows]


def test_cut_off_and_damaged(tmp_path: Path) -> None:
    rows = "1.000000;a;b\nc;7;true;0.500000\n2.000000;d;8;false;1.000000\n"
    whole, _ = read(tmp_path / NAME, rows)
    data = (tmp_path / NAME).read_bytes()
    random = Random(4)
    for length in range(len(data)):
        (tmp_path / NAME).write_bytes(data[:length])
        with suppress(CxbridgeError):
            events = list(open_run(tmp_path / NAME))
            assert events == whole[: len(events)]
    for _ in range(500):
        damaged = bytearray(data)
        for _ in range(random.randint(1, 6)):
            damaged[random.randrange(len(data))] = random.randrange(256)
        (tmp_path / NAME).write_bytes(damaged)
        with suppress(CxbridgeError):
            list(open_run(tmp_path / NAME))
